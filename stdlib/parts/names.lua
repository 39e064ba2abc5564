-- Names by path: symbols that a list of equations was written with become those of the place it stands at.
local scopes = use "parts/scope"
local data, join = scopes.data, scopes.join

local names = {}
-- name of a symbol -> the part outside of any model it is of
local home = setmetatable({}, { __mode = "v" })

-- A part that is in no model yet: where its symbols belong.
function names.register(scope)
  local d = data(scope)
  if d.path ~= "" then home[d.path] = scope end
end

-- What a part or a connector calls so; "r2" is the second entry of the column r.
local function member(at, key)
  local function called(name)
    if scopes.is(at) then return scopes.member(at, name) end
    return rawget(at, name)
  end
  local whole = called(key)
  if whole ~= nil then return whole end
  local column, number = key:match "^(.-)(%d+)$"
  local value = column and column ~= "" and called(column)
  return object_type(value) == "matrix" and value[math.tointeger(tonumber(number))] or nil
end

-- scope.a.b[2].v by its path below the scope, or nil.
function names.navigate(scope, path)
  local at = scope
  for step in path:gmatch "[^.]+" do
    local name, number = step:match "^(.-)%[(%d+)%]$"
    local key = name or step
    if type(at) ~= "table" then return nil end
    if not scopes.is(at) and not scopes.is_pin(at) then return nil end
    at = member(at, key)
    if at == nil then return nil end
    if number then
      if type(at) ~= "table" then return nil end
      at = rawget(at, math.tointeger(tonumber(number)))
    end
  end
  return at
end

-- What is wrong with a path that names nothing: the step that fails, and what there is.
function names.missing(scope, path)
  local before, last = path:match "^(.*)%.([^.]+)$"
  local at = before and names.navigate(scope, before)
  if scopes.is(at) then return scopes.absent(at, last) end
  if before and not at then return names.missing(scope, before) end
  return scopes.absent(scope, path)
end

-- The places of a part directly below a scope, models without a name included.
function names.places(scope, part) return data(scope).by_part[part] or {} end

local function ambiguous(name, places, what)
  local paths = {}
  for i, place in ipairs(places) do paths[i] = data(place).path end
  fail(("%s belongs to a part that this model contains %d times (%s): write %s by its path, %s"):format(name,
    #places,
    table.concat(paths, ", "), what, what == "it" and ("var \"%s.%s\""):format(paths[1], name:match "[^.]+$")
      or ("connect(\"%s.%s\", …)"):format(paths[1], name:match "[^.]+$")))
end
names.ambiguous = ambiguous

-- The symbol of a placed part that a symbol of the same part outside of the model stands for.
local function placed(scope, name)
  local root, rest = name:match "^([^.]+)%.(.+)$"
  local outside = root and home[root]
  if outside then
    local places = names.places(scope, data(outside).part)
    if #places > 1 then ambiguous(name, places, "it") end
    if #places == 1 then return names.navigate(places[1], rest) end
  end
  local found, where = nil, {}
  for _, sub in ipairs(data(scope).parts) do
    if data(sub).class.items then
      local there = names.navigate(sub, name)
      if there ~= nil then found, where[#where + 1] = there, sub end
    end
  end
  if #where > 1 then ambiguous(name, where, "it") end
  return found
end

-- Is it a symbol of a component around this model?
local function around(scope, symbol, name)
  local up = data(scope).parent
  while up do
    local d = data(up)
    if d.path ~= "" and not d.class.items and name:sub(1, #d.path + 1) == d.path .. "." then
      return names.navigate(up, name:sub(#d.path + 2)) == symbol
    end
    up = d.parent
  end
  return false
end

local function own_symbol(scope, symbol, name)
  local d = data(scope)
  local known = d.names[name]
  if type(known) == "table" then
    local what = scopes.is(known) and "a part" or scopes.is_pin(known) and "a connector" or "a list of parts"
    fail(("'%s' is %s of %s and a symbol in its equations; give one of them another name"):format(name, what,
      scopes.title(scope)))
  end
  if known ~= nil then return known end
  local kind, full, made = symbol.kind, join(d.path, name), symbol
  if kind == "input" and d.laws and d.laws[name] then kind = "variable" end
  if kind == "input" and d.parent then
    made = var(full, { unit = symbol.unit })
    d.inputs[#d.inputs + 1] = { symbol = made, name = name }
    d.unknowns = d.unknowns + 1
  elseif d.path ~= "" or kind ~= symbol.kind then
    if kind == "variable" then made = var(full, { unit = symbol.unit })
    elseif kind == "input" then made = input(full, { unit = symbol.unit })
    else
      made = param(full, symbol.value, { unit = symbol.unit })
    end
  end
  if kind == "variable" then
    d.unknowns = d.unknowns + 1
    d.vars[#d.vars + 1] = made
  elseif kind == "parameter" then d.parameters[#d.parameters + 1] = made end
  if not name:find "[.%[]" then
    d.names[name] = made
    d.order[#d.order + 1] = name
  end
  return made
end

local function lookup(scope, symbol)
  local name = symbol.name
  local d = data(scope)
  d.translated = d.translated or {}
  local key = symbol.kind .. " " .. name
  local known = d.translated[key]
  if known ~= nil then return known end
  local result = placed(scope, name)
  if result == nil and name:find("[.%[]") then
    result = around(scope, symbol, name) and symbol or names.navigate(scope, name)
    local first = scopes.member(scope, name:match "^[^.%[]+")
    if result == nil and scopes.is(first) then fail(names.missing(scope, name)) end
  end
  if result == nil then result = own_symbol(scope, symbol, name) end
  d.translated[key] = result
  return result
end

-- An expression or equation of a list of parts, in the symbols of the place where the list stands.
function names.translate(scope, value)
  if type(value) == "number" then return value end
  if not data(scope).class.items then return value end
  local map, any = {}, false
  for _, symbol in ipairs(symbols(value)) do
    if symbol.kind ~= "time" then
      local own = lookup(scope, symbol)
      if own ~= symbol then map[symbol], any = own, true end
    end
  end
  return any and subs(value, map) or value
end

return names
