-- Cells of a notebook: what they print is text as on a terminal; figures, view(x) and the value of the last
-- statement are shown in every form that a notebook may choose from.
local text, value, figure = document.text, document.value, document.figure
local session, recording = document.session, document.recording
local M = {}

local drain_every = 0.2                              -- seconds between two looks at what was printed

-- ── forms of a value ───────────────────────────────────────────────────────────────────────────────────────

-- A picture as an image: exporters drop SVG elements, and keep images.
local function figure_bundle(fig)
  local bundle = { ["text/plain"] = tostring(fig) }
  local good, svg = pcall(function() return fig:svg() end)
  if good then
    bundle["image/svg+xml"] = svg
    bundle["text/html"] = ('<img alt="%s" src="data:image/svg+xml;base64,%s">'):format(
      text.escaped(figure.label(fig)), base64(svg))
  else
    bundle["text/plain"] = (fig.text and fig:text(80) or tostring(fig)) .. tostring(svg)
  end
  return bundle
end

local formulas = { expr = true, equation = true, matrix = true, lti = true, predictor = true }

-- Notebooks know the environments of LaTeX, so a formula with an environment of its own stands without
-- dollars.
local function display_latex(latex)
  if latex:find "^\\begin{align" then return latex end
  return "$\\displaystyle " .. latex .. "$"
end

local function value_bundle(any)
  local bundle = { ["text/plain"] = text.valid(shown(any)) }
  local kind = object_type(any)
  if not kind then return bundle end
  local html = value.html(any)
  if not html then return bundle end
  if html:find("<math", 1, true) and formulas[kind] then
    bundle["text/latex"] = display_latex(any:latex())
  elseif html:find("<table", 1, true) or html:find("<math", 1, true) then
    bundle["text/html"] = html
  end
  return bundle
end

-- ── what a cell shows ──────────────────────────────────────────────────────────────────────────────────────

-- A recorder that keeps nothing: it hands on.
local function recorder_for(publish)
  local record = recording.new()
  local last = clock()
  function record:add(item) publish("stdout", item.error or "") end
  function record:write(words)
    if words ~= "" then publish("stdout", text.valid(words)) end
  end
  function record:show_figure(fig)
    self:drain()
    publish("display", figure_bundle(fig))
  end
  function record:print(values)
    self.plain(table.unpack(values, 1, values.n))
    if clock() - last < drain_every then return end
    last = clock()
    self:drain()
  end
  function record:show(any)
    self:drain()
    if figure.is_picture(any) then return self:show_figure(any) end
    publish("display", value_bundle(any))
  end
  function record:show_frames(figures)
    for _, fig in ipairs(figures) do self:show_figure(fig) end
  end
  return record
end

local function result(record, values, publish)
  record:drain()
  if values.n == 0 or (values.n == 1 and values[1] == nil) then return end
  rawset(_G, "ans", values[1])
  if values.n == 1 and figure.is_picture(values[1]) then
    return publish("result", figure_bundle(values[1]))
  end
  if values.n == 1 then
    publish("result", value_bundle(values[1]))
    local drawing = recording.drawing_of(values[1])
    if drawing then publish("display", figure_bundle(drawing)) end
    return
  end
  local words = {}
  for i = 1, values.n do words[i] = shown(values[i]) end
  publish("result", { ["text/plain"] = text.valid(table.concat(words, " ")) })
end

-- Runs a cell; publish(kind, what) gets what it shows: "stdout" and a text, "display" or "result" and a
-- table from MIME type to text. Returns nothing, or the text of an error and whether it was an interrupt.
function M.run(source, name, publish)
  local record = recorder_for(publish)
  return record:during(function()
    local chunk, problem = session.compile(source, name)
    if not chunk then return text.valid(problem), false end
    local good, message, stopped = run_user(function() result(record, table.pack(chunk()), publish) end)
    if not good then return text.valid(message), stopped end
  end)
end

-- ── questions ──────────────────────────────────────────────────────────────────────────────────────────────

-- What help() says about the name around byte `at` of a cell, or nil.
function M.inspect(source, at)
  local first = #source:sub(1, at):match "[%w_.:]*$"
  local path = source:sub(at - first + 1):match "^[%w_.:]*":gsub("[.:]+$", "")
  if not path:find "^[%a_]" then return nil end
  local own = rawget(_G, path)
  capture_output(true)                               -- no terminal, no pages of a screen
  local good = pcall(help, object_type(own) and own or path)
  local said = captured():gsub("%s+$", "")
  capture_output(false)
  return good and said ~= "" and said or nil
end

-- What a notebook cannot do is said at once.
function M.set_up()
  local function refuse() fail "a notebook has no keyboard to read from: give the value in the cell" end
  _G.io.read = refuse
  local lines = _G.io.lines
  _G.io.lines = function(file, ...)
    if file == nil then refuse() end
    return lines(file, ...)
  end
  _G.os.exit = function() fail "os.exit would end the kernel: use the menu of the notebook" end
end

return M
