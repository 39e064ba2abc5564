-- What a script shows while it runs, kept in order with the statement that showed it: print with its
-- values, figures, everything else that reaches standard output and standard error.
local text, value, figure = document.text, document.value, document.figure
local M = {}

local most_text = 1000000                            -- bytes of text that one statement may leave on a page

local Recorder = {}
Recorder.__index = Recorder

function M.new() return setmetatable({ shows = {}, figures = {}, at = 0, overhead = 0 }, Recorder) end

function Recorder:add(item)
  local list = self.shows[self.at]
  if not list then
    list = {}
    self.shows[self.at] = list
  end
  list[#list + 1] = item
end

-- Text goes on where text stands; of an endless loop that prints, the beginning is kept.
function Recorder:write(words)
  if words == "" then return end
  local list = self.shows[self.at]
  local last = list and list[#list]
  if not last or not last.parts then
    last = { parts = {}, size = 0 }
    self:add(last)
  end
  local room = most_text - last.size
  if room <= 0 then
    last.cut = true
    return
  end
  last.cut = #words > room
  last.parts[#last.parts + 1] = words:sub(1, room)
  last.size = last.size + #words
end

function Recorder:drain() self:write(captured()) end

function Recorder:show_figure(fig)
  self:drain()
  self.figures[#self.figures + 1] = fig
  self:add { figure = #self.figures }
end

-- A line of print, or of the prompt: its values side by side.
function Recorder:print(values)
  local begin = clock()
  self:drain()
  local parts, special = {}, false
  for i = 1, values.n do
    local html, kind = value.html(values[i])
    special = special or html ~= nil
    parts[i] = { html = html, kind = kind or "text", words = html and "" or shown(values[i]) }
  end
  if not special and self.plain then
    self.plain(table.unpack(values, 1, values.n))    -- into what is caught
  elseif not special then
    for i = 1, values.n do parts[i] = parts[i].words end
    self:write(table.concat(parts, " ") .. "\n")
  elseif values.n == 1 then
    self:add { html = '<div class="' .. parts[1].kind .. '" tabindex="0">' .. parts[1].html .. "</div>" }
  else
    for i, part in ipairs(parts) do
      local html = part.html or '<span class="words">' .. text.escaped(part.words) .. "</span>"
      parts[i] = '<div class="' .. part.kind .. '">' .. html .. "</div>"
    end
    self:add { html = '<div class="line" tabindex="0">' .. table.concat(parts, " ") .. "</div>" }
  end
  self.overhead = self.overhead + clock() - begin
end

local drawn_types = { response = true, ["frequency response"] = true }

-- The figure of a value that the prompt draws under its text, or nil.
function M.drawing_of(any) return drawn_types[object_type(any)] and any:plot() or nil end

-- Figures that share a place; a slider, whose name and values are given, chooses among them. Without a script
-- the
-- page has all of them.
function Recorder:show_frames(figures, name, values)
  self:drain()
  local item = { frames = {} }
  for i, fig in ipairs(figures) do
    self.figures[#self.figures + 1] = fig
    item.frames[i] = { figure = #self.figures, label = name .. " = " .. shown(values[i]) }
  end
  self:add(item)
end

-- Shows one value on its own, as the prompt does: figures as figures, lists one by one.
function Recorder:show(any)
  if figure.is_picture(any) then return self:show_figure(any) end
  local list = type(any) == "table" and not object_type(any) and getmetatable(any) == nil
  if list and (object_type(any[1]) or figure.is_picture(any[1])) then
    for _, each in ipairs(any) do self:show(each) end
    return
  end
  self:print { n = 1, any }
  local drawing = M.drawing_of(any)
  if drawing then self:show_figure(drawing) end
end

local function frames_html(frames, drawn)
  local out = {}
  for _, frame in ipairs(frames) do
    out[#out + 1] = ('<div class="frame" data-label="%s"><p class="caption">%s</p>%s</div>'):format(
      text.escaped(frame.label), text.escaped(frame.label), drawn[frame.figure])
  end
  return '<div class="frames">' .. table.concat(out, "\n") .. "</div>"
end

-- The output of a statement as HTML; `drawn` are the figures' pages.
function Recorder:html(i, drawn)
  local out = {}
  for _, item in ipairs(self.shows[i] or {}) do
    if item.parts then
      out[#out + 1] = value.text_block(table.concat(item.parts))
      if item.cut then out[#out + 1] = '<p class="note">… more text, which is left out here</p>' end
    elseif item.frames then
      out[#out + 1] = frames_html(item.frames, drawn)
    elseif item.figure then
      out[#out + 1] = drawn[item.figure]
    elseif item.error then
      out[#out + 1] = '<pre class="error" role="alert">' .. text.escaped(item.error) .. "</pre>"
    else
      out[#out + 1] = item.html
    end
  end
  return table.concat(out, "\n")
end

function Recorder:drawings() return figure.html(self.figures) end

-- While one records, :show() and :save() show the figure there; save still writes its file. Wrapped once.
local show, save = named "figure:show", named "figure:save"
install("figure:show", function(fig, ...)
  if document.recorder then return document.recorder:show_figure(fig) end
  return show(fig, ...)
end)
install("figure:save", function(fig, ...)
  local result = save(fig, ...)
  if document.recorder then document.recorder:show_figure(fig) end
  return result
end)

-- Runs body() with this recorder in place of the terminal.
function Recorder:during(body)
  local stdlib_print, user_print = print, rawget(_G, "print")
  local function recording_print(...) self:print(table.pack(...)) end
  print = recording_print
  rawset(_G, "print", recording_print)
  document.recorder, self.plain = self, user_print
  capture_output(true)
  local results = table.pack(pcall(body))
  self:drain()
  capture_output(false)
  document.recorder, self.plain = nil, nil
  print = stdlib_print
  rawset(_G, "print", user_print)
  if not results[1] then error(results[2], 0) end
  return table.unpack(results, 2, results.n)
end

return M
