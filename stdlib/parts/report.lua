-- What a model of parts looks like: a tree, a diagram, the text of a component.
local scopes = use "parts/scope"
local place = use "parts/place"
local P, data = scopes.P, scopes.data

local report = {}
local most_lines = 60

local function value_text(value)
  if type(value) == "number" then return ("%.6g"):format(value) end
  if type(value) == "function" then return "function" end
  if type(value) == "table" and getmetatable(value) == nil then return "{…}" end
  return tostring(value)
end

local function given_text(class, given)
  local keys, words = {}, {}
  for key in pairs(class.defaults) do keys[#keys + 1] = key end
  table.sort(keys)
  for _, key in ipairs(keys) do
    if given[key] ~= false and given[key] ~= nil then
      words[#words + 1] = key .. " = " .. value_text(given[key])
    end
  end
  return table.concat(words, ", ")
end

-- ── trees ──────────────────────────────────────────────────────────────────────────────────────────────────

local function step_name(scope)
  local d = data(scope)
  return d.path:match "[^.]+$" or d.class.title or "model"
end

local function branch(scope, prefix, lines)
  local subs = data(scope).parts
  for i, sub in ipairs(subs) do
    if #lines >= most_lines then
      if #lines == most_lines then lines[#lines + 1] = { prefix .. "…", "" } end
      return
    end
    local last = i == #subs
    local d = data(sub)
    local what = d.class.name .. (next(d.class.defaults) and "{ " .. given_text(d.class, d.given) .. " }"
      or "")
    lines[#lines + 1] = { prefix .. (last and "└ " or "├ ") .. step_name(sub), what }
    branch(sub, prefix .. (last and "  " or "│ "), lines)
  end
end

local layout = include "layout"

local function tree_of(scope)
  local d = data(scope)
  local lines = { { step_name(scope), #d.parts == 1 and "1 part" or #d.parts .. " parts" } }
  branch(scope, "", lines)
  return layout(lines)
end

function report.tree(part) return tree_of(place.outside(part)) end

-- ── text ───────────────────────────────────────────────────────────────────────────────────────────────────

function report.text(part)
  local d = rawget(part, P)
  if not d.class.items then return d.class.name .. "{ " .. given_text(d.class, d.given) .. " }" end
  local all, left = #part:flat().equations, #part:dae().equations
  return report.tree(part)
    .. ("\n%d equations, %d after aliases and trivial equations are eliminated\n"):format(all, left)
    .. tostring(part:dae())
end

function report.scope_text(scope)
  local d = data(scope)
  local own = d.class.name .. (d.path ~= "" and " " .. d.path or "")
  if #d.parts > 0 then return tree_of(scope) end
  local known = {}
  for _, name in ipairs(d.order) do known[#known + 1] = name end
  return own .. ": " .. table.concat(known, ", ")
end

local function names_of_pins(scope)
  local words = {}
  for _, pin in ipairs(data(scope).pins) do
    words[#words + 1] = ("%s (%s)"):format(rawget(pin, P).name, rawget(pin, P).kind.name)
  end
  for _, given in ipairs(data(scope).inputs) do words[#words + 1] = given.name .. " (input)" end
  for _, name in pairs(data(scope).outputs or {}) do words[#words + 1] = name .. " (output)" end
  table.sort(words)
  return table.concat(words, ", ")
end

local function parameter_lines(class)
  local keys, lines = {}, {}
  for key in pairs(class.defaults) do keys[#keys + 1] = key end
  table.sort(keys)
  for _, key in ipairs(keys) do
    local p = class.defaults[key]
    local value = p.value == false and "not given" or value_text(p.value)
    lines[#lines + 1] = { "  " .. key, value .. (p.unit and " " .. p.unit or ""), p.text or "" }
  end
  return lines
end

-- Text, parameters, connectors, equations, source.
function report.component(class)
  local out = { class.name .. (class.text ~= "" and ": " .. prose(class.text) or "") }
  local lines = parameter_lines(class)
  if #lines > 0 then out[#out + 1] = layout(lines) end
  local scope = place.example(class)
  if scope then
    local pins = names_of_pins(scope)
    if pins ~= "" then out[#out + 1] = "connectors: " .. pins end
    for _, entry in ipairs(data(scope).equations) do
      out[#out + 1] = "  " .. tostring(entry[1]):gsub("\n", "\n  ")
    end
    if #data(scope).parts > 0 then out[#out + 1] = tree_of(scope) end
  end
  if class.source ~= "" then out[#out + 1] = "source: " .. class.source end
  if class.example ~= "" then
    out[#out + 1] = "example:\n  " .. block("\n" .. class.example):gsub("\n", "\n  ")
  end
  return table.concat(out, "\n")
end

-- ── diagrams ───────────────────────────────────────────────────────────────────────────────────────────────

local function owner_below(pin, scope)
  local at = rawget(pin, P).scope
  while data(at).parent and data(at).parent ~= scope and at ~= scope do at = data(at).parent end
  return at
end

-- The connections directly inside a model: lists of { part, connector }.
local function connections_of(scope)
  local d = data(scope)
  local list = {}
  for _, members in ipairs(d.connected or use("parts/joints").connect(scope)) do
    local ends = {}
    for _, pin in ipairs(members) do
      ends[#ends + 1] = { part = owner_below(pin, scope), pin = rawget(pin, P).path }
    end
    list[#list + 1] = ends
  end
  return list
end

local function diagram_text(scope)
  local lines = {}
  for i, ends in ipairs(connections_of(scope)) do
    local words = {}
    for _, e in ipairs(ends) do words[#words + 1] = e.pin end
    lines[#lines + 1] = { ("(%d)"):format(i), table.concat(words, " ── ") }
  end
  for _, connection in ipairs(data(scope).connections) do
    local signal = true
    for i = 1, connection.n do
      signal = signal and not scopes.is_pin(connection.ends[i]) and connection.n > 1
    end
    if signal then lines[#lines + 1] = { "→", tostring(connection) } end
  end
  return #lines > 0 and layout(lines) or "no connections"
end

local function dot_text(scope)
  local out = { "graph model {",
    "  node [shape=box, style=rounded, fontname=Helvetica]; edge [fontname=Helvetica, fontsize=9];" }
  for _, sub in ipairs(data(scope).parts) do
    out[#out + 1] = ("  %q [label=%q];"):format(data(sub).path,
      step_name(sub) .. "\n" .. data(sub).class.name)
  end
  for i, ends in ipairs(connections_of(scope)) do
    local function port(e) return e.pin:match "[^.]+$" end
    if #ends == 2 then
      out[#out + 1] = ("  %q -- %q [taillabel=%q, headlabel=%q];"):format(data(ends[1].part).path,
        data(ends[2].part).path,
        port(ends[1]), port(ends[2]))
    else
      out[#out + 1] = ("  node%d [shape=point, label=\"\"];"):format(i)
      for _, e in ipairs(ends) do
        out[#out + 1] = ("  node%d -- %q [headlabel=%q];"):format(i, data(e.part).path, port(e))
      end
    end
  end
  out[#out + 1] = "}\n"
  return table.concat(out, "\n")
end

-- m:diagram() as text; m:diagram "circuit.svg" by graphviz, "circuit.dot" its source.
function report.diagram(part, file)
  local scope = place.outside(part)
  if file == nil then
    part:flat()
    return diagram_text(scope)
  end
  if type(file) ~= "string" then fail "diagram: expected a file name, as in m:diagram \"circuit.svg\"" end
  part:flat()
  local format = file:match "%.(%a+)$"
  local source = dot_text(scope)
  if format == "dot" or format == "gv" then return write_file(file, source, "diagram") end
  if format ~= "svg" and format ~= "png" and format ~= "pdf" then
    fail(("diagram: '%s' must end in .svg, .png, .pdf or .dot"):format(file))
  end
  local name = os.tmpname()
  write_file(name, source, "diagram")
  local quoted = "'" .. file:gsub("'", "'\\''") .. "'"
  local done = os.execute(("dot -T%s -o %s %s 2>/dev/null"):format(format, quoted, name))
  os.remove(name)
  if not done then
    fail("diagram: the program 'dot' is needed for " .. format .. " (Debian package graphviz); m:diagram \""
      ..
      file:gsub("%.%a+$", ".dot") .. "\" writes its source, m:diagram() the connections as text")
  end
end

return report
