-- A part at one place of a model: its path, connectors, variables, parts and equations. The function of a
-- component sees it as `self`; m.motor.shaft is one, too.
local kinds = use "parts/kinds"

local P = {}                    -- the key of what scripts do not see
local deepest = 50              -- levels of parts inside parts
local Scope = { __name = "part", __metatable = "part" }
local Pin = { __name = "pin", __metatable = "pin" }
local scopes = { P = P, Scope = Scope }
local methods = {}              -- of self, in the function of a component

local function join(path, name) return path == "" and name or path .. "." .. name end
scopes.join = join

function scopes.data(scope) return rawget(scope, P) end
function scopes.is(value)
  return type(value) == "table" and getmetatable(value) == "part" and rawget(value, P) ~= nil
end
function scopes.is_pin(value) return type(value) == "table" and getmetatable(value) == "pin" end

-- "motor" or "this model", for messages.
function scopes.title(scope)
  local d = rawget(scope, P)
  return d.path ~= "" and d.path or (d.class.title or "this model")
end

-- ── names ──────────────────────────────────────────────────────────────────────────────────────────────────

local words = {}
for word in ([[and break do else elseif end false for function goto if in local nil not or repeat return then
  true until while dot ddot given path]]):gmatch "%a+" do words[word] = "a word of the language" end

-- Methods of models, and fields that every model has; others (sys.M, sys.energy) are those of lagrange{ … }.
function scopes.is_reserved(name)
  if not words[1] then
    words[1] = true
    for _, row in ipairs(rows()) do
      words[row.name:match "^model:([%a_]+)$" or 1] = "a method of every model"
    end
    for _, row in ipairs(documented) do
      words[row.name:match "^model:([%a_]+)$" or 1] = "a method of every model"
    end
    for word in ("kind name form parameters inputs equations differential algebraic domain flat dae tree "
      .. "diagram tf")
      :gmatch "%a+" do
      words[word] = "a method of every model"
    end
  end
  return words[name]
end

local function check_name(d, name)
  if type(name) ~= "string" or not name:find "^[%a_\x80-\xff][%w_\x80-\xff]*$" then
    fail(("'%s' is not a name for a part or a variable: use letters, digits and _"):format(tostring(name)))
  end
  if d.names[name] ~= nil then
    fail(("%s has two things called '%s'"):format(d.path ~= "" and d.path or "the model", name))
  end
  local taken = methods[name] and "a function of self" or scopes.is_reserved(name)
  if taken then fail(("'%s' cannot be the name of a part or a variable: it is %s"):format(name, taken)) end
end

local function enter(d, name, value)
  check_name(d, name)
  d.names[name] = value
  d.order[#d.order + 1] = name
end

-- ── connectors ─────────────────────────────────────────────────────────────────────────────────────────────

function Pin:__index(key)
  local d = rawget(self, P)
  if type(key) ~= "string" then
    fail(("%s cannot be indexed with %s"):format(tostring(self), tostring(key)))
  end
  local known = {}
  for _, set in ipairs { d.kind.across, d.kind.through } do
    for _, v in ipairs(set) do known[#known + 1] = v.name end
  end
  fail(("%s (%s) has no variable '%s'."):format(tostring(self), d.kind.name, key) .. did_you_mean(key, known))
end

function Pin:__tostring() return rawget(self, P).path end
function Pin:__newindex() fail(tostring(self) .. " is a connector; it cannot be changed") end

local function make_pin(scope, name, kind, attributes)
  local d = rawget(scope, P)
  local path = join(d.path, name)
  local pin = { [P] = { scope = scope, name = name, path = path, kind = kind,
    optional = attributes.optional } }
  for _, set in ipairs { kind.across, kind.through } do
    for _, v in ipairs(set) do
      local full, unit = path .. "." .. v.name, { unit = v.unit }
      pin[v.name] = v.size > 1 and var(full, v.size, unit) or var(full, unit)
      d.unknowns = d.unknowns + v.size
      if set == kind.through then d.through = d.through + v.size end
    end
  end
  setmetatable(pin, Pin)
  d.pins[#d.pins + 1] = pin
  return pin
end

-- ── what a scope answers ───────────────────────────────────────────────────────────────────────────────────

local function is_expression(value) return object_type(value) == "expr" and #symbols(value) > 0 end

-- { 1, 2, 0 } or { sin(t), 0, 0 }: numbers and expressions, and nothing else.
local function is_vector(value)
  if type(value) ~= "table" or getmetatable(value) ~= nil or #value == 0 then return false end
  for _, entry in ipairs(value) do
    if type(entry) ~= "number" and object_type(entry) ~= "expr" then return false end
  end
  return true
end

-- A parameter is a symbol with the part's path; what is given as an expression is that expression.
local function parameter(d, key)
  local default, raw = d.class.defaults[key], d.given[key]
  local path = join(d.path, key)
  if type(raw) == "string" and (default.unit or type(default.value) == "number") then raw = rational(raw) end
  local kind = object_type(raw)
  local function from_outside(value)
    return d.parent and d.translate and d.translate(d.parent, value) or value
  end
  if is_expression(raw) or kind == "matrix" then
    return from_outside(raw)
  elseif type(raw) == "number" or kind == "expr" then
    local symbol = param(path, raw, { unit = default.unit or "", text = default.text or "" })
    d.parameters[#d.parameters + 1] = symbol
    return symbol
  elseif is_vector(raw) then
    local column = {}
    for i, value in ipairs(raw) do
      column[i] = is_expression(value) and from_outside(value)
        or param(path .. i, value, { unit = default.unit or "" })
    end
    return vec(column)
  end
  return raw
end

local function known_names(d)
  local known = {}
  for name in pairs(d.names) do known[#known + 1] = name end
  for name in pairs(d.class.defaults) do if d.names[name] == nil then known[#known + 1] = name end end
  table.sort(known)
  return known
end

-- "motor has no part, connector or variable 'x'. Did you mean …?", or what it has.
function scopes.absent(scope, key, what, known)
  known = known or known_names(rawget(scope, P))
  local hint = did_you_mean(key, known)
  if hint == "" and #known > 0 then
    hint = " It has " .. table.concat(known, ", ", 1, math.min(#known, 12)) .. (#known > 12 and ", …" or ".")
  end
  return ("%s has no %s '%s'."):format(scopes.title(scope), what or "part, connector or variable", key)
    .. hint
end

function scopes.member(scope, key)
  local d = rawget(scope, P)
  local value = d.names[key]
  if value ~= nil then return value end
  if d.class.defaults[key] ~= nil then
    value = parameter(d, key)
    d.names[key] = value
    return value
  end
end

function Scope:__index(key)
  local value = scopes.member(self, key)
  if value ~= nil then return value end
  local d = rawget(self, P)
  if key == "given" then return d.given end
  if key == "path" then return d.path end
  if methods[key] then return methods[key] end
  if type(key) ~= "string" then
    fail(("%s cannot be indexed with %s"):format(scopes.title(self), tostring(key)))
  end
  fail(scopes.absent(self, key))
end

-- ── what a scope is made of ────────────────────────────────────────────────────────────────────────────────

local function array(scope, name, list)
  local entries, n = {}, 0
  if select(2, name:gsub("%[", "")) > 20 then
    fail(("'%s' has lists inside lists, more than 20 levels deep: does a list contain itself?"):format(
      name:match "^[^%[]*"))
  end
  for key in pairs(list) do
    if math.type(key) ~= "integer" then
      fail(("%s is a list of parts with the key '%s'; parts by name stand in model{ … }"):format(name,
        tostring(key)))
    end
    n = math.max(n, key)
  end
  for i = 1, n do
    if list[i] == nil then fail(("entry %d of the list of parts '%s' is nil"):format(i, name)) end
    entries[i] = scopes.made(scope, ("%s[%d]"):format(name, i), list[i])
  end
  return entries
end

-- What stands under this name: a connector, a part, a list of them, or a value with a name.
function scopes.made(scope, name, value)
  local d = rawget(scope, P)
  if kinds.is(value) then return make_pin(scope, name, value, {}) end
  if type(value) == "table" and getmetatable(value) == "component" then
    fail(("%s is the component %s and not a part of this kind: write %s{}"):format(name, value.name,
      value.name))
  end
  local part = scopes.as_part(value, name)
  if part then return scopes.place(part, name, scope) end
  if type(value) == "table" and getmetatable(value) == nil then return array(scope, name, value) end
  local kind = object_type(value)
  if kind == "expr" or kind == "matrix" or type(value) == "number" then return value end
  fail(("'%s' of %s must be a part, a connector kind, a list of these or an expression, not %s"):format(name,
    scopes.title(scope), type(value) == "nil" and "nil" or "a " .. (kind or type(value)), d.path))
end

function scopes.set(scope, name, value)
  local d = rawget(scope, P)
  check_name(d, name)
  enter(d, name, scopes.made(scope, name, value))
end

function Scope:__newindex(name, value)
  local d = rawget(self, P)
  if d.closed then
    fail(("cannot set '%s': %s is made; a model with other parts is another model{ … }"):format(
      tostring(name),
      scopes.title(self)))
  end
  if d.class.defaults[name] ~= nil then
    fail(("'%s' is a parameter of %s"):format(name, scopes.title(self)))
  end
  scopes.set(self, name, value)
end

-- A new place for a part, empty.
function scopes.new(part, name, parent)
  local p = parent and rawget(parent, P)
  local path = p and join(p.path, name) or name
  local depth = p and p.depth + 1 or 0
  local class = part and rawget(part, P).class or {}
  if depth > deepest then
    local count, most, up = {}, parent, parent           -- how often each component stands above this place
    while up do
      local of = rawget(up, P).class
      count[of] = (count[of] or 0) + 1
      if count[of] >= count[rawget(most, P).class] then most = up end
      up = rawget(up, P).parent
    end
    local repeated = rawget(most, P).class
    fail(("parts inside parts, more than %d levels deep: %s.%s"):format(deepest,
      #path > 60 and path:sub(1, 60) .. "…" or path,
      count[repeated] > 1 and (" Does the component %s contain itself?"):format(repeated.name) or ""))
  end
  return setmetatable({ [P] = {
    path = path, part = part, class = class, parent = parent, depth = depth, root = parent == nil,
      name = name,
    names = {}, order = {}, parts = {}, pins = {}, vars = {}, inputs = {}, parameters = {}, equations = {},
    connections = {}, events = {}, starts = {}, guesses = {}, by_part = {}, references = {}, sums = {},
    norms = {}, rigid = {}, anchored = {}, idle = {},
    given = part and rawget(part, P).given or {}, unknowns = 0, through = 0, rows = 0,
  } }, Scope)
end

-- ── self ───────────────────────────────────────────────────────────────────────────────────────────────────

local function declare(self, name, make, attributes, list)
  local d = rawget(self, P)
  if d.closed then
    fail(("%s is made; variables are declared in the function of its component"):format(scopes.title(self)))
  end
  check_name(d, name)
  local size = type(attributes) == "number" and attributes or nil
  local full = join(d.path, name)
  local symbol = size and make(full, size) or make(full, attributes or {})
  enter(d, name, symbol)
  list[#list + 1] = symbol
  return symbol
end

-- self:var("v", { unit = "V", text = "voltage" }), self:var("r", 3)
function methods:var(name, attributes)
  local d = rawget(self, P)
  d.unknowns = d.unknowns + (type(attributes) == "number" and attributes or 1)
  return declare(self, name, var, attributes, d.vars)
end

-- local v, i = self:vars "v i"
function methods:vars(names)
  local all = {}
  for name in names:gmatch "%S+" do all[#all + 1] = self:var(name) end
  return table.unpack(all)
end

-- A signal that somebody else gives: another part, an equation, or the user if nothing is around this part.
function methods:input(name, attributes)
  local d = rawget(self, P)
  local own = {}
  for key, value in pairs(attributes or {}) do own[key] = value end
  local default = own.default
  own.default = nil
  local symbol = declare(self, name, d.root and input or var, own, d.vars)
  if not d.root then d.unknowns = d.unknowns + 1 end
  d.inputs[#d.inputs + 1] = { symbol = symbol, name = name, default = default }
  return symbol
end

-- A signal that this part gives.
function methods:output(name, attributes)
  local symbol = self:var(name, attributes)
  self:gives(symbol)
  return symbol
end

-- This variable is a signal that the part gives.
function methods:gives(symbol)
  local d = rawget(self, P)
  d.outputs = d.outputs or {}
  d.outputs[symbol] = symbol.name:match "[^.]+$"
end

-- A connector that need not be connected: what flows through it is 0 then.
function methods:optional(name, kind)
  local d = rawget(self, P)
  check_name(d, name)
  local pin = make_pin(self, name, kind, { optional = true })
  enter(d, name, pin)
  return pin
end

function methods:start(symbol, value)
  local d = rawget(self, P)
  if value ~= nil and value ~= false then d.starts[#d.starts + 1] = { symbol, value } end
end

function methods:guess(symbol, value)
  local d = rawget(self, P)
  if value ~= nil and value ~= false then d.guesses[#d.guesses + 1] = { symbol, value } end
end

-- self:event{ when = v, direction = -1, reset = { [w] = -w } }
function methods:event(event)
  local d = rawget(self, P)
  if type(event) ~= "table" then
    fail(("%s: an event is a table, { when = …, reset = { … } }, not %s"):format(scopes.title(self),
      type(event) == "nil" and "nil" or "a " .. (object_type(event) or type(event))))
  end
  d.events[#d.events + 1] = event
end

-- A value that changes at events only.
function methods:discrete(name, value, attributes)
  local symbol = self:var(name, attributes)
  local d = rawget(self, P)
  d.equations[#d.equations + 1] = { der(symbol) ~ 0, "constant between events" }
  d.rows = d.rows + 1
  self:start(symbol, value)
  return symbol
end

-- This part fixes the potential of a connector.
function methods:reference(pin)
  local d = rawget(self, P)
  d.references[#d.references + 1] = pin
end

-- The potentials of these groups of connectors have nothing to do with each other: a transformer.
function methods:isolated(...)
  rawget(self, P).islands = { ... }
end

-- Orientations have one condition more than they have degrees of freedom, |q| = 1. It is said once for all
-- connectors that are rigidly joined, by connections and by parts that call rigid(a, b), and never where one
-- of
-- them is held. Of several bodies the first says it; the multipliers of the others are 0.
function methods:normalise(pin, equation, multiplier)
  local d = rawget(self, P)
  d.norms[#d.norms + 1] = { pin = pin, equation = equation, multiplier = multiplier }
  d.rows = d.rows + 1
end

function methods:rigid(a, b)
  local d = rawget(self, P)
  d.rigid[#d.rigid + 1] = { a, b }
end

-- This part takes no notice of the angle of a connector and exerts no torque there: the end of a spring.
function methods:idle(...)
  for _, pin in ipairs { ... } do rawget(self, P).idle[pin] = true end
end

function methods:anchored(pin)
  local d = rawget(self, P)
  d.anchored[#d.anchored + 1] = pin
end

scopes.methods = methods
return scopes
