-- Connections: equal across variables, through variables that add up to 0; what is open, driven twice,
-- floating.
local scopes = use "parts/scope"
local names = use "parts/names"
local P, data = scopes.P, scopes.data

local joints = {}

local function pin_data(pin) return rawget(pin, P) end
local function describe(pin) return ("%s (%s)"):format(pin_data(pin).path, pin_data(pin).kind.name) end

-- ── ends ───────────────────────────────────────────────────────────────────────────────────────────────────

local function is_below(scope, top)
  while scope do
    if scope == top then return true end
    scope = data(scope).parent
  end
  return false
end

-- The path of a connector of a part that is in no model, below that part; and the part.
local function outside_path(pin)
  local d = pin_data(pin)
  local top = d.scope
  while data(top).parent do top = data(top).parent end
  local prefix = data(top).path
  return prefix == "" and d.path or d.path:sub(#prefix + 2), data(top).part
end

local function placed_pin(scope, pin)
  if is_below(pin_data(pin).scope, scope) then return pin end
  local rest, part = outside_path(pin)
  local places = names.places(scope, part)
  if #places == 0 then
    fail(("connect: %s belongs to a part that is not in %s; give the part a name there: model{ name = "
      .. "part, … }")
      :format(tostring(pin), scopes.title(scope)))
  end
  if #places > 1 then names.ambiguous(tostring(pin), places, "the connector") end
  return names.navigate(places[1], rest)
end

-- What is inside a part has been connected there; a part has connectors of its own for what is around it.
local function own_pin(scope, pin)
  local at = pin_data(pin).scope
  if at == scope or data(at).parent == scope then return pin end
  local whole = data(at).parent
  while data(whole).parent and data(whole).parent ~= scope do whole = data(whole).parent end
  fail(("connect: %s is inside %s; give %s a connector of its own and connect that one: p = %s kind, "
    .. "connect(\"p\", \"%s\") in %s, then connect(\"%s.p\", …)"):format(describe(pin), scopes.title(whole),
    scopes.title(whole), pin_data(pin).kind.name,
    pin_data(pin).path:sub(#data(whole).path + 2), scopes.title(whole), data(whole).name))
end

local function no_connector(scope, path, found)
  local before, last = path:match "^(.*)%.([^.]+)$"
  local at = scopes.is(found) and found or before and names.navigate(scope, before)
  if not scopes.is(at) then return names.missing(scope, path) end
  local known = {}
  for _, pin in ipairs(data(at).pins) do known[#known + 1] = pin_data(pin).name end
  for _, given in ipairs(data(at).inputs) do known[#known + 1] = given.name end
  for _, name in pairs(data(at).outputs or {}) do known[#known + 1] = name end
  table.sort(known)
  if at == found then
    return ("'%s' is a whole part; name one of its connectors: %s"):format(path, table.concat(known, ", "))
  end
  return scopes.absent(at, last, "connector", known)
end

-- An end of a connection as a connector or an expression of this place.
local function resolve(scope, e)
  if type(e) == "string" then
    local found = names.navigate(scope, e)
    if scopes.is_pin(found) then return own_pin(scope, found) end
    if object_type(found) == "expr" then return found end
    fail("connect: " .. no_connector(scope, e, found))
  end
  if scopes.is_pin(e) then return own_pin(scope, placed_pin(scope, e)) end
  return names.translate(scope, e)
end

-- ── sets ───────────────────────────────────────────────────────────────────────────────────────────────────

local function root_of(up, pin)
  while up[pin] ~= pin do
    up[pin] = up[up[pin]]
    pin = up[pin]
  end
  return pin
end

local function units(kind)
  local list = {}
  for _, v in ipairs(kind.across) do list[#list + 1] = v.name .. " [" .. v.unit .. "]" end
  return table.concat(list, ", ")
end

local function check_kinds(a, b)
  local ka, kb = pin_data(a).kind, pin_data(b).kind
  if ka == kb then return end
  fail(("connect: %s and %s cannot be joined: %s against %s; a part that has a connector of each kind goes "
    .. "between them"):format(describe(a), describe(b), units(ka), units(kb)))
end

-- Inputs and outputs. What gives the others their value: an output, a number, an expression, t or an input of
-- the model; else a variable that is no input of a part in here; else the first end.
local function source_of(scope, ends)
  local driver, weak
  for _, e in ipairs(ends) do
    if scopes.is_pin(e) then
      fail(("connect: %s is a connector and %s a signal; a sensor makes a signal of a connector, a "
        .. "source with "
        .. "an input (signal_source, signal_force) gives a signal to one"):format(describe(e),
        tostring(ends[1] == e and ends[2] or ends[1])))
    end
    local of_part = joints.signals(scope, "outputs")[e]
    if of_part == scope then of_part = nil end           -- its own output: from in here it gets its value
    local known = type(e) == "number" or e.kind == "time" or e.kind == "input" or #symbols(e) ~= 1
    if of_part or known then
      if driver then
        fail(("connect: %s and %s are both outputs: an input has one source"):format(tostring(driver),
          tostring(e)))
      end
      driver = e
    end
    local input = joints.signals(scope, "inputs")[e]
    if not weak and (not input or input == scope) then weak = e end
  end
  return driver or weak or ends[1]
end

local function join_signals(scope, ends, connection)
  local d, source = data(scope), source_of(scope, ends)
  d.wires = d.wires or {}
  for _, e in ipairs(ends) do
    if e ~= source then
      d.wires[#d.wires + 1] = { source, e }
      d.equations[#d.equations + 1] = { e ~ source, tostring(connection) }
      d.rows = d.rows + 1
      joints.drive(scope, e, tostring(connection))
    end
  end
end

-- The outputs or inputs of all parts of the model, symbol -> scope.
function joints.signals(scope, which)
  local top = scope
  while data(top).parent do top = data(top).parent end
  local d = data(top)
  if d.all_outputs == nil then
    d.all_outputs, d.all_inputs = {}, {}
    local function collect(at)
      for symbol in pairs(data(at).outputs or {}) do d.all_outputs[symbol] = at end
      for _, given in ipairs(data(at).inputs) do d.all_inputs[given.symbol] = at end
      for _, sub in ipairs(data(at).parts) do collect(sub) end
    end
    collect(top)
  end
  return which == "outputs" and d.all_outputs or d.all_inputs
end

function joints.drive(scope, symbol, how)
  local top = scope
  while data(top).parent do top = data(top).parent end
  local d = data(top)
  d.driven = d.driven or {}
  if d.driven[symbol] then
    fail(("%s is driven twice: by %s and by %s; a signal has one source"):format(tostring(symbol),
      d.driven[symbol], how))
  end
  d.driven[symbol] = how
end

-- ── one place ──────────────────────────────────────────────────────────────────────────────────────────────

local function across_equations(d, members)
  local first = members[1]
  local p = pin_data(first)
  for i = 2, #members do
    for _, v in ipairs(p.kind.across) do
      d.equations[#d.equations + 1] = { members[i][v.name] ~ first[v.name],
        ("connect(%s, %s)"):format(p.path, pin_data(members[i]).path) }
      d.rows = d.rows + v.size
    end
  end
end

local function through_equations(scope, members)
  local d = data(scope)
  local kind = pin_data(members[1]).kind
  for _, v in ipairs(kind.through) do
    local sum
    for _, pin in ipairs(members) do
      local into = pin[v.name]
      if pin_data(pin).scope == scope then into = -into end
      sum = sum and sum + into or into
    end
    local zero = v.size > 1 and zeros(v.size, 1) or 0
    local entry = { zero ~ sum, "sum at " .. pin_data(members[1]).path }
    d.equations[#d.equations + 1] = entry
    d.rows = d.rows + v.size
    d.sums[#d.sums + 1] = { members = members, through = v.name, entry = entry }
  end
end

local function own_connections(scope)
  local d, up, order, opened = data(scope), {}, {}, {}
  for _, connection in ipairs(d.connections) do
    local ends, pins = {}, 0
    for i = 1, connection.n do
      ends[i] = resolve(scope, connection.ends[i])
      if scopes.is_pin(ends[i]) then pins = pins + 1 end
    end
    if connection.n == 1 and pins == 1 then
      opened[ends[1]] = true
    elseif pins < #ends then
      join_signals(scope, ends, connection)
    else
      for _, pin in ipairs(ends) do
        if up[pin] == nil then up[pin], order[#order + 1] = pin, pin end
        check_kinds(ends[1], pin)
        local a, b = root_of(up, ends[1]), root_of(up, pin)
        if a ~= b then up[b] = a end
      end
    end
  end
  return up, order, opened
end

local function open_pin(scope, pin, opened)
  local d, p = data(scope), pin_data(pin)
  if not (p.optional or opened[pin]) then
    fail(("%s is connected to nothing; connect(%s, …), or connect(\"%s\") alone to leave it open"):format(
      describe(pin), p.path, p.path))
  end
  through_equations(scope, { pin })
end

-- Equations of the connections at one place; every connector of its parts has to be in one of them.
function joints.connect(scope)
  local up, order, opened = own_connections(scope)
  local sets, list = {}, {}
  for _, pin in ipairs(order) do
    local top = root_of(up, pin)
    if not sets[top] then
      sets[top] = {}
      list[#list + 1] = sets[top]
    end
    table.insert(sets[top], pin)
  end
  for _, members in ipairs(list) do
    across_equations(data(scope), members)
    through_equations(scope, members)
  end
  for _, sub in ipairs(data(scope).parts) do
    for _, pin in ipairs(data(sub).pins) do
      if up[pin] == nil then open_pin(scope, pin, opened) end
    end
  end
  return list
end

-- ── floating ───────────────────────────────────────────────────────────────────────────────────────────────

local function each_pin(scope, f)
  for _, pin in ipairs(data(scope).pins) do f(pin) end
  for _, sub in ipairs(data(scope).parts) do each_pin(sub, f) end
end

local function join(up, a, b)
  a, b = root_of(up, a), root_of(up, b)
  if a ~= b then up[b] = a end
end

local function islands_of(scope, up)
  local d = data(scope)
  local groups = d.islands
  if not groups then
    local by_kind = {}
    for _, pin in ipairs(d.pins) do
      local kind = pin_data(pin).kind
      by_kind[kind] = by_kind[kind] or {}
      table.insert(by_kind[kind], pin)
    end
    groups = {}
    for _, group in pairs(by_kind) do groups[#groups + 1] = group end
  end
  if #d.parts == 0 then
    for _, group in ipairs(groups) do
      for i = 2, #group do
        if up[group[1]] and up[group[i]] then join(up, group[1], group[i]) end
      end
    end
  end
  for _, sub in ipairs(d.parts) do islands_of(sub, up) end
end

-- The conditions |q| = 1 of a model, { equation, path }: one for each group of rigidly joined connectors.
function joints.norms(top, sets)
  local up, claims, said, list = {}, {}, {}, {}
  local function known(pin)
    up[pin] = up[pin] or pin
    return pin
  end
  local held = {}
  local function read(scope)
    local d = data(scope)
    for _, claim in ipairs(d.norms) do
      known(claim.pin)
      claims[#claims + 1] = { claim, d.path }
    end
    for _, pair in ipairs(d.rigid) do join(up, known(pair[1]), known(pair[2])) end
    for _, pin in ipairs(d.anchored) do held[#held + 1] = known(pin) end
    for _, sub in ipairs(d.parts) do read(sub) end
  end
  read(top)
  if #claims == 0 then return list end
  for _, members in ipairs(sets) do
    for i = 2, #members do join(up, known(members[1]), known(members[i])) end
  end
  for _, pin in ipairs(held) do said[root_of(up, pin)] = true end
  for _, entry in ipairs(claims) do
    local claim, path = entry[1], entry[2]
    local group = root_of(up, claim.pin)
    list[#list + 1] = { said[group] and claim.multiplier ~ 0 or claim.equation, path }
    said[group] = true
  end
  return list
end

-- Where only parts meet that take no notice of an angle, as the ends of springs, it has its idle value, in
-- place of one of the sums of torques, which all say 0 = 0 there.
function joints.settle_idle(top, sets)
  local up, turned, settled = {}, {}, {}
  each_pin(top, function(pin)
    if next(pin_data(pin).kind.idle) then up[pin] = pin end
  end)
  if not next(up) then return end
  for _, members in ipairs(sets) do
    if up[members[1]] then
      for i = 2, #members do join(up, members[1], members[i]) end
    end
  end
  for pin in pairs(up) do
    local d = data(pin_data(pin).scope)
    if #d.parts == 0 and not d.idle[pin] then turned[root_of(up, pin)] = true end
  end
  local function settle(scope)
    for _, sum in ipairs(data(scope).sums) do
      local pin = sum.members[1]
      local group, kind = up[pin] and root_of(up, pin), pin_data(pin).kind
      for across, value in pairs(kind.idle) do
        if group and not turned[group] and not settled[group] and kind.pairs[across] == sum.through then
          settled[group], sum.entry[1] = true, pin[across] ~ value
        end
      end
    end
    for _, sub in ipairs(data(scope).parts) do settle(sub) end
  end
  settle(top)
end

-- The connectors that are wanted, and a function: which of them stands for all that hang together with it.
function joints.islands(top, sets, is_wanted)
  local up, pins = {}, {}
  each_pin(top, function(pin)
    if is_wanted(pin) then up[pin], pins[#pins + 1] = pin, pin end
  end)
  if #pins > 0 then islands_of(top, up) end
  for _, members in ipairs(sets) do
    if up[members[1]] then
      for i = 2, #members do join(up, members[1], members[i]) end
    end
  end
  return pins, function(pin) return root_of(up, pin) end
end

-- Circuits in which no potential is fixed: their equations repeat each other.
function joints.check_floating(top, sets)
  local fixed = {}
  local pins, island = joints.islands(top, sets, function(pin) return pin_data(pin).kind.reference end)
  if #pins == 0 then return end
  local function references(scope)
    for _, pin in ipairs(data(scope).references) do fixed[island(pin)] = true end
    for _, sub in ipairs(data(scope).parts) do references(sub) end
  end
  references(top)
  for _, pin in ipairs(pins) do
    if not fixed[island(pin)] and #data(pin_data(pin).scope).references == 0 then
      local part, kind = scopes.title(pin_data(pin).scope), pin_data(pin).kind.name
      fail(("the circuit of %s floats: nothing fixes a potential (%s) in it; connect one of its points to a "
        .. "ground: "
        .. "gnd = components.electrical.ground{}, connect(\"%s\", \"gnd.p\")"):format(part, kind,
          pin_data(pin).path))
    end
  end
end

return joints
