-- What a model of parts looks like: a tree, a diagram, the text of a component.
local scopes = use "parts/scope"
local place = use "parts/place"
local P, data = scopes.P, scopes.data

local report = {}
local most_lines = 60

-- "{1, 2, 3}" of a few numbers, "{…}" of anything else.
local function list_text(list)
  local words = {}
  for k, entry in ipairs(list) do words[k] = type(entry) == "number" and ("%.6g"):format(entry) or nil end
  local shown = #words == #list and #list <= 6 and (#list > 0 or next(list) == nil)
  return shown and "{" .. table.concat(words, ", ") .. "}" or "{…}"
end

local function value_text(value)
  if type(value) == "number" then return ("%.6g"):format(value) end
  if type(value) == "function" then return "function" end
  if type(value) == "table" and getmetatable(value) == nil then return list_text(value) end
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

-- Every place with parts inside, the model first.
local function composites(scope, list)
  list = list or {}
  if #data(scope).parts > 0 then list[#list + 1] = scope end
  for _, sub in ipairs(data(scope).parts) do composites(sub, list) end
  return list
end

local most_connections = 200

local function diagram_text(top)
  local lines = {}
  for _, scope in ipairs(composites(top)) do
    for _, members in ipairs(data(scope).connected) do
      local words = {}
      for k, pin in ipairs(members) do words[k] = rawget(pin, P).path end
      lines[#lines + 1] = { ("(%d)"):format(#lines + 1), table.concat(words, " ── ") }
    end
    for _, wire in ipairs(data(scope).wires or {}) do
      lines[#lines + 1] = { "→", tostring(wire[1]) .. " → " .. tostring(wire[2]) }
    end
  end
  local more = #lines - most_connections
  for k = #lines, most_connections + 1, -1 do lines[k] = nil end
  if more > 0 then lines[#lines + 1] = { "…", more .. " more" } end
  return #lines > 0 and layout(lines) or "no connections"
end

local function quoted(words) return '"' .. words:gsub('[\\"]', "\\%0"):gsub("\n", "\\n") .. '"' end

-- Connectors of parts with parts inside are points of their own.
local function node_of(pin)
  local p = rawget(pin, P)
  local inside = #data(p.scope).parts > 0
  return quoted(inside and p.path or data(p.scope).path), inside and "" or p.name
end

local function joint_of(scope, number) return quoted(("joint %d of %s"):format(number, data(scope).path)) end

local function dot_nodes(scope, indent, out)
  for number, members in ipairs(data(scope).connected) do
    if #members ~= 2 then
      out[#out + 1] = ('%s%s [shape=point, label=""];'):format(indent, joint_of(scope, number))
    end
  end
  for _, sub in ipairs(data(scope).parts) do
    local d = data(sub)
    local label = quoted(step_name(sub) .. "\n" .. d.class.name)
    if #d.parts == 0 then
      out[#out + 1] = ("%s%s [label=%s];"):format(indent, quoted(d.path), label)
    else
      out[#out + 1] = ("%ssubgraph %s { label=%s;"):format(indent, quoted("cluster " .. d.path), label)
      for _, pin in ipairs(d.pins) do
        out[#out + 1] = ("%s  %s [label=%s, shape=circle, fontsize=9, width=0.2];"):format(indent,
          quoted(rawget(pin, P).path), quoted(rawget(pin, P).name))
      end
      dot_nodes(sub, indent .. "  ", out)
      out[#out + 1] = indent .. "}"
    end
  end
end

local function dot_joint(scope, number, members, out)
  if #members == 2 then
    local a, port_a = node_of(members[1])
    local b, port_b = node_of(members[2])
    out[#out + 1] = ("  %s -- %s [taillabel=%s, headlabel=%s];"):format(a, b, quoted(port_a), quoted(port_b))
    return
  end
  for _, pin in ipairs(members) do
    local node, port = node_of(pin)
    out[#out + 1] = ("  %s -- %s [headlabel=%s];"):format(joint_of(scope, number), node, quoted(port))
  end
end

-- A signal belongs to the part whose path it begins with; anything else is a box with its text.
local function signal_node(value, scope, out)
  local text = tostring(value)
  if object_type(value) == "expr" and #symbols(value) == 1 and value.name then
    local at, name = value.name:match "^(.+)%.([^.]+)$"
    for _, sub in ipairs(data(scope).parts) do
      if data(sub).path == at then return quoted(at), name end
    end
  end
  out[#out + 1] = ("  %s [label=%s, shape=plaintext];"):format(quoted("signal " .. text), quoted(text))
  return quoted("signal " .. text), ""
end

local function dot_text(top)
  local out = { "graph model {",
    "  node [shape=box, style=rounded, fontname=Helvetica]; edge [fontname=Helvetica, fontsize=9];",
    "  fontname=Helvetica; fontsize=11; color=gray60;" }
  dot_nodes(top, "  ", out)
  for _, scope in ipairs(composites(top)) do
    for number, members in ipairs(data(scope).connected) do dot_joint(scope, number, members, out) end
    for _, wire in ipairs(data(scope).wires or {}) do
      local from, out_name = signal_node(wire[1], scope, out)
      local to, in_name = signal_node(wire[2], scope, out)
      out[#out + 1] = ("  %s -- %s [dir=forward, style=dashed, taillabel=%s, headlabel=%s];"):format(from, to,
        quoted(out_name), quoted(in_name))
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
