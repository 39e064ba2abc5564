-- Kinds of connectors: which variables a connector has, with units.

local Kind = { __name = "connector", __metatable = "connector" }
Kind.__index = function(kind, key)
  fail(("the connector kind '%s' has no field '%s'"):format(rawget(kind, "name"), tostring(key)))
end

local function listed(kind, what)
  local words = {}
  for _, v in ipairs(rawget(kind, what)) do
    local size = v.size > 1 and (" (%d)"):format(v.size) or ""
    words[#words + 1] = v.name .. size .. (v.unit ~= "" and " [" .. v.unit .. "]" or "")
  end
  return table.concat(words, ", ")
end

function Kind:__tostring()
  return ("connector %s: across %s, through %s"):format(rawget(self, "name"), listed(self, "across"),
    listed(self, "through"))
end

local function variables(name, what, given)
  if type(given) ~= "table" then
    fail(("connector: %s of '%s' must be a table { v = \"V\" }"):format(what, name))
  end
  local list = {}
  for key, unit in pairs(given) do
    if type(key) ~= "string" then
      fail(("connector: %s of '%s' must be a table { v = \"V\" }"):format(what, name))
    end
    local size = 1
    if type(unit) == "table" then unit, size = unit[1], unit[2] end
    if type(unit) ~= "string" or math.type(size) ~= "integer" or size < 1 then
      fail(("connector: %s.%s of '%s' must be a unit such as \"V\", or { unit, size }"):format(what, key,
        name))
    end
    list[#list + 1] = { name = key, unit = unit, size = size }
  end
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

local kinds = {}

function kinds.connector(name, options)
  if type(name) ~= "string" then
    fail "connector: the first argument is a name, as in connector(\"pin\", { … })"
  end
  return setmetatable({ name = name, across = variables(name, "across", options.across or {}),
    through = variables(name, "through", options.through or {}), reference = options.reference or false,
    pairs = options.pairs or {}, idle = options.idle or {}, held_by = options.held_by or false }, Kind)
end

-- The through variable that does work along an across variable: the force to a position.
function kinds.partner(kind, across)
  local through = rawget(kind, "through")
  if #through == 1 then return through[1].name end
  return rawget(kind, "pairs")[across]
    or fail(("connector %s does not say which through variable belongs to %s: pairs = { %s = … }"):format(
      rawget(kind, "name"), across, across))
end

function kinds.is(value) return rawequal(getmetatable(value), "connector") and type(value) == "table" end

return kinds
