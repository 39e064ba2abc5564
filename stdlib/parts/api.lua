-- component, connector, connect and model, and what a part answers.
local scopes = use "parts/scope"
local kinds = use "parts/kinds"
local place = use "parts/place"
local P, data = scopes.P, scopes.data

local Part = { __name = "part", __metatable = "part" }
scopes.Part = Part

function scopes.is_part(value)
  return type(value) == "table" and getmetatable(value) == "part" and rawget(value, P).scope ~= false
    and rawget(value, P).serial ~= nil
end

-- What can stand in a list of parts: parts, places of parts (a copy of what stands there), other models.
function scopes.as_part(value, name)
  if scopes.is_part(value) then return value end
  if scopes.is(value) and data(value).part then return data(value).part end
  local kind = object_type(value)
  if kind == "model" or kind == "lti" or kind == "idmodel" then
    return use("parts/adapt").part(value, name)
  end
end

-- ── the dae models of a part ───────────────────────────────────────────────────────────────────────────────

local methods = {}

-- All equations, as the parts and connections say them.
function methods:flat()
  local d = rawget(self, P)
  place.outside(self)
  if not d.flat then d.flat, d.sets = use("parts/flat").model(self) end
  return d.flat
end

local cannot_be_solved = { "structurally singular", "depend on each other", "follows from the others",
  "contradicts the others" }

-- Parameters that a part was given as 0 where its default is another value: a capacitor without capacitance.
local function given_zeros(scope, list)
  local d = data(scope)
  for key, default in pairs(d.class.defaults or {}) do
    local usual = type(default.value) == "number" and default.value or 0
    if d.given[key] == 0 and usual ~= 0 then list[#list + 1] = scopes.join(d.path, key) end
  end
  for _, sub in ipairs(d.parts) do given_zeros(sub, list) end
  table.sort(list)
  return list
end

-- "V, W, g, connect(V.p, W.p) fix …": where there are too many equations, which elimination does not say.
local function fixed_twice(self)
  local _, message = pcall(methods.flat(self).index, methods.flat(self))
  local where = tostring(message):match "over%-determined: [^\n]- of (.-) for %d+ unknown"
  return where and where .. " fix the same quantity twice: remove one, or put another part between them"
end

-- What can be done about this error of a model of parts, or nil.
local function remedy(self, message)
  for _, words in ipairs(cannot_be_solved) do
    if message:find(words, 1, true) then
      local found, why = pcall(use "parts/unfixed", place.outside(self), rawget(self, P).sets or {})
      if found and why then return why end
      return not message:find("over-determined", 1, true) and fixed_twice(self) or nil
    end
  end
  local zeros = message:find("not finite there", 1, true) and given_zeros(place.outside(self), {}) or {}
  if #zeros == 0 then return nil end
  return ('%s is 0 and was divided by; params = { ["%s"] = 0 } makes it the number 0 before that'):format(
    table.concat(zeros, ", "), zeros[1])
end

-- f(…), whose errors say what can be done about them.
local function explained(self, f, ...)
  local results = table.pack(pcall(f, ...))
  if results[1] then return table.unpack(results, 2, results.n) end
  local message = results[2]
  local why = type(message) == "string" and remedy(self, message)
  if why then
    message = message:gsub("\n  These parts fix the same quantity twice[^\n]*", "") .. "\n  " .. why
  end
  error(message, 0)
end

-- The equations that are left after aliases and trivial equations are eliminated: what is integrated.
function methods:dae()
  local d = rawget(self, P)
  local flat = methods.flat(self)
  d.dae = d.dae or explained(self, flat.eliminate, flat)
  return d.dae
end

-- The transfer function of a linear model, exactly where its parameters are exact.
function methods:tf(u, y)
  local model = methods.dae(self)
  local fix, inputs = {}, {}
  for k = 1, #model.differential do fix[model.differential[k]] = 0 end
  for k = 1, #model.inputs do inputs[model.inputs[k]] = 0 end
  if y == nil then fail "tf: expected an input and an output, as in m:tf(m.u, m.C.v)" end
  local at = model:init{ fix = fix, inputs = inputs }
  local G = model:linearize(at, { inputs = { u }, outputs = { y } }):tf()
  if #G.inputs == 1 then return G end
  local total, power = nil, tf({ 1 }, { 1 })          -- u, u′, …: each derivative is a factor s
  for k = 1, #G.inputs do
    local part = G:channel(1, k)
    if tostring(part.num) ~= "(0)" then
      local term = series(power, part)
      total = total and parallel(total, term) or term
    end
    power = series(power, tf({ 1, 0 }, { 1 }))
  end
  return (total or tf({ 0 }, { 1 })):named{ inputs = { tostring(u) }, outputs = { tostring(y) } }
end

function methods:tree() return use("parts/report").tree(self) end
function methods:diagram(...) return use("parts/report").diagram(self, ...) end

Part.__model = methods.dae

-- Questions about the equations are answered for all of them.
local of_all = {}
for word in ([[index dof structure constraints pencil equations kind differential algebraic]]):gmatch "%a+" do
  of_all[word] = true
end

-- The values among these that are not 0, and the parameters that are: elimination may have divided by them,
-- and
-- without them the index may be another.
local function split_zeros(values)
  local zeros, rest = {}, {}
  for key, value in pairs(values) do
    local name = type(key) == "string" and key or object_type(key) == "expr" and key.name
    if value == 0 and name then zeros[#zeros + 1] = name else rest[key] = value end
  end
  return zeros, rest
end

-- The model that answers this question, and the options for it.
local function model_for(self, key, options)
  local flat = methods.flat(self)
  if of_all[key] then return flat, options end
  local values = options
  if key ~= "with" then values = type(options) == "table" and rawget(options, "params") end
  if type(values) ~= "table" then return methods.dae(self), options end
  local zeros, rest = split_zeros(values)
  if #zeros == 0 then return methods.dae(self), options end
  local model = flat:eliminate{ zero = zeros }
  if key == "with" then return model, rest end
  local own = {}
  for word, value in pairs(options) do own[word] = value end
  own.params = rest
  return model, own
end

local function model_member(self, key)
  local model = model_for(self, key)
  local value = model[key]
  if type(value) ~= "function" then return value end
  return function(first, options, ...)
    if not rawequal(first, self) then return value(first, options, ...) end
    local own, rest = model_for(self, key, options)
    return explained(self, own[key], own, rest, ...)
  end
end

function Part:__index(key)
  if methods[key] then return methods[key] end
  local scope = place.outside(self)
  local value = scopes.member(scope, key)
  if value ~= nil then return value end
  if type(key) == "string" and scopes.is_reserved(key) then return model_member(self, key) end
  return scope[key]            -- the error that says what there is
end

function Part:__newindex(key)
  key = tostring(key)
  fail(("cannot set '%s': a part does not change; part{ %s = … } is a copy with another parameter"):format(
    key, key))
end

function Part:__call(changes)
  if changes ~= nil and (type(changes) ~= "table" or getmetatable(changes) ~= nil) then
    fail "a copy of a part: part{ R = 2 }, or part{} with the same parameters"
  end
  return place.copy(self, changes)
end

-- for name, part in pairs(m): what has a name in it, in order.
function Part:__pairs()
  local d, i = data(place.outside(self)), 0
  return function()
    i = i + 1
    local name = d.order[i]
    if name then return name, d.names[name] end
  end
end

function Part:__tostring() return use("parts/report").text(self) end

scopes.Scope.__tostring = function(self) return use("parts/report").scope_text(self) end
place.Component.__tostring = function(self) return use("parts/report").component(self) end

local function as_model(value) return scopes.is_part(value) and methods.dae(value) or value end

return { as_model = as_model, component = place.component, connector = kinds.connector,
  connect = place.connect,
  model = place.model }
