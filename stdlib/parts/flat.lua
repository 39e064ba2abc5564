-- The equations of all parts of a model in one list, each with the path of the part it is from.
local scopes = use "parts/scope"
local names = use "parts/names"
local joints = use "parts/joints"
local P, data = scopes.P, scopes.data

local flat = {}

local function translated_event(scope, event)
  local own = {}
  for key, value in pairs(event) do own[key] = value end
  if own.when ~= nil then own.when = names.translate(scope, own.when) end
  if type(own.reset) == "table" then
    own.reset = {}
    for key, value in pairs(event.reset) do
      local symbol = key
      if type(key) == "string" then
        symbol = names.navigate(scope, key)
        if symbol == nil then
          fail(("an event of %s resets '%s', but that part has no variable of this name")
            :format(scopes.title(scope), key))
        end
      else symbol = names.translate(scope, key) end
      own.reset[symbol] = names.translate(scope, value)
    end
  end
  return own
end

-- All sets of connectors that are joined, of this place and those below.
local function connected(scope, sets)
  local d = data(scope)
  d.connected = d.connected or joints.connect(scope)
  for _, set in ipairs(d.connected) do sets[#sets + 1] = set end
  for _, sub in ipairs(d.parts) do connected(sub, sets) end
  return sets
end

local function collect(scope, all)
  local d = data(scope)
  for _, sub in ipairs(d.parts) do collect(sub, all) end
  for _, entry in ipairs(d.equations) do
    all.equations[#all.equations + 1] = entry[1]
    all.notes[#all.equations] = entry[2] or (d.path ~= "" and d.path or nil)
  end
  for _, event in ipairs(d.events) do all.events[#all.events + 1] = translated_event(scope, event) end
  for _, pair in ipairs(d.starts) do all.start[pair[1]] = pair[2] end
  for _, pair in ipairs(d.guesses) do all.guess[pair[1]] = pair[2] end
  for _, given in ipairs(d.inputs) do
    if not d.root then all.inputs[#all.inputs + 1] = { given = given, scope = scope } end
  end
end

-- Symbols in equations that a model or a component with parts says itself: they may give an input its value.
local function symbols_of_composites(scope, found)
  local d = data(scope)
  if d.class.items or #d.parts > 0 then
    for _, entry in ipairs(d.equations) do
      if entry[2] == nil then                        -- connections have a note
        for _, symbol in ipairs(symbols(entry[1])) do found[symbol] = true end
      end
    end
  end
  for _, sub in ipairs(d.parts) do symbols_of_composites(sub, found) end
  return found
end

local function close_inputs(top, all)
  if #all.inputs == 0 then return end
  local driven = data(top).driven or {}
  local found
  for _, entry in ipairs(all.inputs) do
    local symbol = entry.given.symbol
    if not driven[symbol] then
      found = found or symbols_of_composites(top, {})
      if not found[symbol] then
        if entry.given.default == nil then
          local name = symbol.name
          fail(("the input %s has no source; connect(source.y, \"%s\"), an equation var \"%s\" ~ …, or an "
            .. "input of the model: u = input \"u\", connect(u, \"%s\")"):format(tostring(symbol), name, name,
              name))
        end
        all.equations[#all.equations + 1] = symbol ~ entry.given.default
        all.notes[#all.equations] = "default of " .. tostring(symbol)
      end
    end
  end
end

local function check_own_pins(top)
  for _, pin in ipairs(data(top).pins) do
    local p = rawget(pin, P)
    if not p.optional then
      fail(("%s (%s) is open: this part is not a model by itself; put it into one and connect its "
        .. "connectors"):format(
        p.path, p.kind.name))
    end
  end
end

-- Inputs that a connection drives and that an equation of a composite speaks of as well.
local function driven_and_said(top)
  local found, words = symbols_of_composites(top, {}), {}
  for symbol, how in pairs(data(top).driven or {}) do
    if found[symbol] then words[#words + 1] = ("%s, which %s drives"):format(tostring(symbol), how) end
  end
  table.sort(words)
  return words
end

-- "equations of motor: …; unknowns of its own: x, y", where they are not as many as each other.
local function own_equations(scope)
  local d, rows, said, unknowns = data(scope), 0, {}, {}
  for _, entry in ipairs(d.equations) do
    if entry[2] == nil then                          -- connections have a note
      rows = rows + entry[1].lhs.rows*entry[1].lhs.cols
      said[#said + 1] = tostring(entry[1])
    end
  end
  local size = 0
  for _, symbol in ipairs(d.vars) do
    if not (object_type(symbol) == "expr" and symbol.kind == "input") then
      unknowns[#unknowns + 1] = tostring(symbol)
      size = size + (object_type(symbol) == "matrix" and #symbol or 1)
    end
  end
  if rows == size then return nil end
  local function few(list)
    return #list == 0 and "none" or table.concat(list, ", ", 1, math.min(#list, 6)) .. (#list > 6 and ", …"
      or "")
  end
  return ("%s: equations of its own: %s; unknowns of its own: %s"):format(scopes.title(scope), few(said),
    few(unknowns))
end

-- Equations that are too many or too few, by the parts they are in.
local function check_count(top, all)
  local rows, unknowns = 0, 0
  for _, equation in ipairs(all.equations) do
    rows = rows + equation.lhs.rows * equation.lhs.cols
  end
  local function count(scope)
    unknowns = unknowns + data(scope).unknowns
    for _, sub in ipairs(data(scope).parts) do count(sub) end
  end
  count(top)
  if rows == unknowns then return end
  local twice = rows > unknowns and driven_and_said(top) or {}
  if #twice > 0 then
    fail(("the model has %d equations for %d unknowns: its own equations contain %s; a signal has one source")
      :format(rows, unknowns, table.concat(twice, ", ")))
  end
  local words = {}
  local function explain(scope)
    local d = data(scope)
    if d.class.items or #d.parts > 0 then words[#words + 1] = own_equations(scope) end
    for _, sub in ipairs(d.parts) do explain(sub) end
  end
  explain(top)
  fail(("the model has %d equations for %d unknowns: %d too %s\n  %s"):format(rows, unknowns,
    math.abs(rows - unknowns), rows > unknowns and "many" or "few",
    table.concat(words, "\n  ", 1, math.min(#words, 6))))
end

-- A dae model of everything as it stands, and the sets of connectors that are joined.
function flat.model(part)
  local top = data(rawget(part, P).scope)
  local scope = rawget(part, P).scope
  local all = { equations = {}, notes = {}, events = {}, start = {}, guess = {}, inputs = {} }
  check_own_pins(scope)
  local sets = connected(scope, {})
  joints.settle_idle(scope, sets)
  collect(scope, all)
  joints.check_floating(scope, sets)
  close_inputs(scope, all)
  for _, norm in ipairs(joints.norms(scope, sets)) do
    all.equations[#all.equations + 1] = norm[1]
    all.notes[#all.equations] = norm[2] ~= "" and norm[2] or nil
  end
  check_count(scope, all)
  local list = all.equations
  list.notes, list.name = all.notes, top.class.title
  if next(all.start) then list.start = all.start end
  if next(all.guess) then list.guess = all.guess end
  local model
  if #all.events > 0 then
    list.events = use("parts/clocks").order(all.events, all.equations, function()
      list.events = nil
      local names, states = {}, dae(list).differential
      for k = 1, #states do names[k] = symbols(states[k])[1].name end
      return names
    end)
  end
  model = dae(list)
  if top.class.items and top.class.items.units == "check" then
    local clashes = model:units()
    if #clashes > 0 then fail("units: equation " .. table.concat(clashes, "\n  equation ")) end
  end
  return model, sets
end

return flat
