-- Parts and their places: components, models of parts, and what their lists and functions say.
local scopes = use "parts/scope"
local names = use "parts/names"
local P, data = scopes.P, scopes.data

local place = {}
local Component = { __name = "component", __metatable = "component" }
local Connection = { __name = "connection", __metatable = "connection" }
local serial, made_of = 0, {}         -- parts made so far; of each component

-- ── parts ──────────────────────────────────────────────────────────────────────────────────────────────────

function place.new_part(class, given)
  serial = serial + 1
  return setmetatable({ [P] = { class = class, given = given, serial = serial } }, scopes.Part)
end

-- A parameter whose default is a number, or that has a unit, is a number or an expression.
local function check_value(class, key, value)
  local default = class.defaults[key]
  if not default.unit and type(default.value) ~= "number" then return end
  local kind, got = object_type(value), nil
  if type(value) == "string" then got = ("the text '%s'"):format(value)
  elseif value == true or type(value) == "function" then got = "a " .. type(value)
  elseif type(value) == "number" and (value ~= value
    or math.abs(value) == math.huge and math.abs(default.value or 0) ~= math.huge) then
    got = value ~= value and "nan" or "infinity"
  elseif type(value) == "table" and getmetatable(value) ~= nil and not kind then got = "a part" end
  if not got or type(value) == "string" and pcall(rational, value) then return end
  local unit = default.unit and default.unit ~= "" and " [" .. default.unit .. "]" or ""
  fail(("%s: %s%s must be a number or an expression, not %s%s"):format(class.name, key, unit, got,
    type(value) == "function" and ": of the time, write it with t, as in sin(2*t)" or ""))
end

local function with_defaults(class, given, usage)
  if given ~= nil and (type(given) ~= "table" or getmetatable(given) ~= nil) then
    fail(("%s: parameters are a table, %s{ %s }"):format(class.name, class.name, usage))
  end
  local values = {}
  for key, default in pairs(class.defaults) do values[key] = default.value end
  for key, value in pairs(given or {}) do
    if class.defaults[key] == nil then
      local known = {}
      for word in pairs(class.defaults) do known[#known + 1] = word end
      table.sort(known)
      fail(("%s has no parameter '%s'."):format(class.name, tostring(key))
        .. did_you_mean(tostring(key), known)
        .. (#known > 0 and " (parameters: " .. table.concat(known, ", ") .. ")" or " (it has none)"))
    end
    check_value(class, key, value)
    values[key] = value
  end
  return values
end

function Component:__call(given)
  return place.new_part(self, with_defaults(self, given,
    next(self.defaults) and next(self.defaults) .. " = …" or ""))
end

-- part{ R = 2 }: a copy, with other parameters.
function place.copy(part, changes)
  local d = rawget(part, P)
  local given = {}
  for key, value in pairs(d.given) do given[key] = value end
  for key, value in pairs(changes or {}) do
    with_defaults(d.class, { [key] = value }, "")
    given[key] = value
  end
  return place.new_part(d.class, given)
end

local function default_of(name, key, value)
  if type(key) ~= "string" then
    fail(("component '%s': parameters have names, { R = 1 }, not [%s]"):format(name, tostring(key)))
  end
  if type(value) == "table" and getmetatable(value) == nil and (value.unit or value.text) then
    return { value = value[1], unit = value.unit, text = value.text }
  end
  return { value = value }
end

function place.component(name, defaults, body, about)
  if type(name) ~= "string" or not name:find "^[%a_][%w_]*$" then
    fail 'component: expected a name first: component("motor", { k = 0.1 }, function(self) … end)'
  end
  if type(defaults) == "function" then defaults, body, about = {}, defaults, body end
  if type(defaults) ~= "table" or type(body) ~= "function" then
    fail(("component '%s': expected component(name, { parameters }, function(self) … end)"):format(name))
  end
  local list = {}
  for key, value in pairs(defaults) do list[key] = default_of(name, key, value) end
  about = about or {}
  return setmetatable({ name = name, defaults = list, body = body, text = about.text or "",
    source = about.source or "", example = about.example or "", gives = about.gives or "" }, Component)
end

function place.model(items)
  if type(items) ~= "table" or getmetatable(items) ~= nil then
    fail "model: expected a list of parts, connections and equations: model { R = R, connect(R.n, C.p) }"
  end
  local kept = {}
  for key, value in pairs(items) do kept[key] = value end
  if kept.units ~= nil and kept.units ~= "check" then fail 'model: units can be "check"' end
  local title = kept.name
  if title ~= nil and type(title) ~= "string" then
    fail("model: name must be a string, got a " .. type(title))
  end
  kept.name = nil
  if next(kept) == nil then
    fail "model: it has no parts and no equations; for example model { R = R, C = C, connect(R.n, C.p), … }"
  end
  local part = place.new_part({ name = "model", defaults = {}, items = kept, title = title, text = "" }, {})
  place.outside(part)          -- what is wrong with the list is said here, at the user's line
  return part
end

-- ── places ─────────────────────────────────────────────────────────────────────────────────────────────────

local option_words = { start = true, guess = true, events = true, name = true, units = true }

-- The named entries of a list in the order in which the parts were made.
local function named_entries(items)
  local list = {}
  for key, value in pairs(items) do
    if type(key) == "string" and not option_words[key] then
      local part = scopes.is_part(value) and rawget(value, P).serial or math.huge
      list[#list + 1] = { key = key, value = value, order = part }
    elseif math.type(key) ~= "integer" and type(key) ~= "string" then
      fail(("model: an entry has the key [%s]; parts have names, R = resistor{}"):format(tostring(key)))
    end
  end
  table.sort(list, function(a, b)
    if a.order ~= b.order then return a.order < b.order end
    return a.key < b.key
  end)
  return list
end

local function free_name(d, name)
  if d.names[name] == nil then return name end
  local n = 2
  while d.names[name .. n] ~= nil do n = n + 1 end
  return name .. n
end

-- An equation in the symbols of this place.
local function add_own(scope, own, note)
  local d = data(scope)
  d.equations[#d.equations + 1] = { own, note }
  d.rows = d.rows + own.lhs.rows*own.lhs.cols
end

local function add_equation(scope, equation, note)
  add_own(scope, names.translate(scope, equation), note)
end

place.add_own = add_own

local absorb
local most_nested = 100         -- lists inside lists

local function add_item(scope, item, i, depth)
  local kind = object_type(item)
  if kind == "equation" then return add_equation(scope, item) end
  if type(item) == "table" and getmetatable(item) == "connection" then
    local d = data(scope)
    d.connections[#d.connections + 1] = item
    return
  end
  if type(item) == "table" and getmetatable(item) == nil then
    if item.when ~= nil then return scope:event(item) end
    return absorb(scope, item, depth + 1)
  end
  local part = scopes.as_part(item, "entry " .. i)
  if not part then
    fail(("entry %d of %s must be an equation, a connection or a part, not %s"):format(i, scopes.title(scope),
      type(item) == "boolean" and "a boolean: write ~, not == or =" or kind and "a " .. kind
        or type(item) == "table" and tostring(getmetatable(item)) or "a " .. type(item)))
  end
  local class = rawget(part, P).class
  if class.items then
    local d = data(scope)
    d.by_part[part] = { scope }
    return absorb(scope, class.items)
  end
  scopes.set(scope, free_name(data(scope), class.name), part)
end

local function symbol_pairs(scope, what, given)
  if given == nil then return {} end
  if type(given) ~= "table" then fail(("%s must be a table { [C.v] = 0 }"):format(what)) end
  local list = {}
  for key, value in pairs(given) do
    local symbol = key
    if type(key) == "string" then
      symbol = names.navigate(scope, key)
      if symbol == nil then
        fail(what .. ": " .. names.missing(scope, key))
      end
    else symbol = names.translate(scope, key) end
    list[#list + 1] = { symbol, names.translate(scope, value) }
  end
  table.sort(list, function(a, b) return tostring(a[1]) < tostring(b[1]) end)
  return list
end

local function add_options(scope, items)
  for _, pair in ipairs(symbol_pairs(scope, "start", items.start)) do scope:start(pair[1], pair[2]) end
  for _, pair in ipairs(symbol_pairs(scope, "guess", items.guess)) do scope:guess(pair[1], pair[2]) end
  for _, event in ipairs(items.events or {}) do scope:event(event) end
end

-- u ~ -k*x: an equation for an input says what it is; it is no input of this model then.
local function note_law(d, item)
  if object_type(item) ~= "equation" then return end
  local left = item.lhs
  for row = 1, left.rows do
    local symbol = left[row]
    if object_type(symbol) == "expr" and symbol.kind == "input" then
      d.laws = d.laws or {}
      d.laws[symbol.name] = true
    end
  end
end

-- power = R.v*R.i: an expression with a name, in the symbols of this place; P = var "P" is the symbol itself.
local function set_value(scope, key, value)
  local own = names.translate(scope, value)
  if object_type(own) == "expr" and data(scope).names[key] == own then return end
  scopes.set(scope, key, own)
end

-- Parts first, then connections and equations in order, then what is said about the start.
function absorb(scope, items, depth)
  depth = depth or 0
  if depth > most_nested then
    fail(("%s has lists inside lists, more than %d levels deep: does a list contain itself?"):format(
      scopes.title(scope), most_nested))
  end
  local values, n = {}, 0
  for _, entry in ipairs(named_entries(items)) do
    local kind = object_type(entry.value)
    if kind == "expr" or kind == "matrix" then values[#values + 1] = entry
    else scopes.set(scope, entry.key, entry.value) end
  end
  for key in pairs(items) do if math.type(key) == "integer" then n = math.max(n, key) end end
  for i = 1, n do
    local item = items[i]
    if item == nil then fail(("entry %d of %s is nil"):format(i, scopes.title(scope))) end
    if scopes.as_part(item, "") then add_item(scope, item, i, depth) end
  end
  for i = 1, n do note_law(data(scope), items[i]) end
  for _, entry in ipairs(values) do set_value(scope, entry.key, entry.value) end
  for i = 1, n do
    if not scopes.as_part(items[i], "") then add_item(scope, items[i], i, depth) end
  end
  add_options(scope, items)
end

local function check_balance(scope)
  local d = data(scope)
  if d.class.items or #d.parts > 0 then return end
  local wanted = d.unknowns - d.through
  for _, pin in ipairs(d.pins) do
    for _, v in ipairs(rawget(pin, P).kind.across) do wanted = wanted - v.size end
  end
  for _, given in ipairs(d.inputs) do wanted = wanted - (d.root and 0 or 1) end
  -- one equation for every variable of its own and every through variable
  wanted = wanted + d.through
  if wanted == d.rows then return end
  fail(("%s (component %s) has %d equation%s, but needs %d: one for each of its own variables and each "
    .. "through "
    .. "variable of its connectors"):format(scopes.title(scope), d.class.name, d.rows,
      d.rows == 1 and "" or "s", wanted))
end

-- What the function of a component returns; an error in it names the part.
local function called(scope, body)
  local good, result = pcall(body, scope)
  if good then return result end
  local d = data(scope)
  if type(result) == "string" and d.depth < 10 and not result:find("\n  in ", 1, true) then
    result = ("%s\n  in %s (component %s)"):format(result, scopes.title(scope), d.class.name)
  end
  error(result, 0)
end

-- Runs what the part says, at this place.
local function fill(scope)
  local d = data(scope)
  if d.class.items then
    absorb(scope, d.class.items)
    if d.class.ports then d.class.ports(scope) end
  else
    local list = called(scope, d.class.body)
    if object_type(list) == "equation" or type(list) == "table" and getmetatable(list) == "connection" then
      list = { list }
    end
    if list ~= nil and (type(list) ~= "table" or getmetatable(list) ~= nil) then
      fail(("component %s: its function must return a list of equations and connections, not a %s"):format(
        d.class.name,
        object_type(list) or type(list)))
    end
    absorb(scope, list or {})
    check_balance(scope)
  end
  d.closed = true
  return scope
end

-- The part under this name below a place.
function scopes.place(part, name, parent)
  local d = data(parent)
  local scope = scopes.new(part, name, parent)
  data(scope).translate = names.translate
  d.parts[#d.parts + 1] = scope
  local places = d.by_part[part]
  if places then places[#places + 1] = scope else d.by_part[part] = { scope } end
  return fill(scope)
end

-- A part in no model: components have a name of their own, "resistor_2", so that two of them can be told
-- apart.
function place.outside(part)
  local d = rawget(part, P)
  if d.scope then return d.scope end
  if d.busy then fail(("the part %s contains itself"):format(d.class.name)) end
  d.busy = true
  local name = ""
  if not d.class.items then
    local count = (made_of[d.class.name] or 0) + 1
    made_of[d.class.name] = count
    name = count == 1 and d.class.name or d.class.name .. "_" .. count
  end
  local good, result = pcall(function()
    local scope = scopes.new(part, name, nil)
    fill(scope)
    names.register(scope)
    return scope
  end)
  d.busy = nil
  if not good then error(result, 0) end
  d.scope = result
  return result
end

function place.connect(...)
  local ends = table.pack(...)
  if ends.n == 0 then fail "connect: connect(a, b) joins two connectors, connect(a) leaves one open" end
  for i = 1, ends.n do
    local e = ends[i]
    if e == nil then fail(("connect: argument %d is nil"):format(i)) end
    local good = scopes.is_pin(e) or type(e) == "string" or type(e) == "number" or object_type(e) == "expr"
    if not good then
      local hint = scopes.is(e) or scopes.is_part(e) and true
      fail(("connect: argument %d must be a connector such as R.p, its path as text, or a signal, not %s")
        :format(i,
        hint and "a whole part: name one of its connectors" or "a " .. (object_type(e) or type(e))))
    end
  end
  return setmetatable({ ends = ends, n = ends.n }, Connection)
end

function Connection:__tostring()
  local words = {}
  for i = 1, self.n do words[i] = tostring(self.ends[i]) end
  return "connect(" .. table.concat(words, ", ") .. ")"
end

-- A component with its default parameters, to be looked at; nil where it needs others.
function place.example(class)
  local part = place.new_part(class, with_defaults(class, nil, ""))
  local good, scope = pcall(function() return fill(scopes.new(part, "", nil)) end)
  return good and scope or nil
end

place.Component = Component
return place
