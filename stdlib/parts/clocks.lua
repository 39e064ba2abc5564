-- What happens in parts with clocks at one instant, whatever the order in which the parts were made. First
-- the outputs (events with phase = "output") change, each after those that it depends on, then the states
-- behind them (phase = "state"), which see all outputs: y_k = C x_k + D u_k, x_{k+1} = A x_k + B u_k.
local clocks = {}

-- Ticks of a part at t0, t0 + Ts, …: outputs and states are { [symbol] = its next value }.
function clocks.run(self, Ts, t0, outputs, states)
  local function tick(name, phase, reset)
    local next_tick = self:discrete(name, t0, { unit = "s", text = "next sample" })
    reset[next_tick] = next_tick + Ts
    self:event { when = t - next_tick, direction = 2, reset = reset, phase = phase }
  end
  tick("tick", "output", outputs)
  if states then tick("state_tick", "state", states) end
end

-- Symbols of each equation, and equations of each symbol, by name; equations of what is constant left out.
local function incidence(equations, is_state)
  local of_equation, of_symbol = {}, {}
  for _, equation in ipairs(equations) do
    local names, unknown = {}, false
    for _, symbol in ipairs(symbols(equation)) do
      names[#names + 1] = symbol.name
      unknown = unknown or not is_state[symbol.name]
    end
    if unknown then
      of_equation[#of_equation + 1] = names
      for _, name in ipairs(names) do
        of_symbol[name] = of_symbol[name] or {}
        table.insert(of_symbol[name], #of_equation)
      end
    end
  end
  return of_equation, of_symbol
end

-- The states that a value depends on without delay: through equations, as far as the next state.
local function states_behind(values, is_state, of_equation, of_symbol)
  local found, seen, open = {}, {}, {}
  local function meet(name)
    if is_state[name] then found[name] = true
    elseif not seen[name] then seen[name], open[#open + 1] = true, name end
  end
  for _, value in ipairs(values) do
    for _, symbol in ipairs(symbols(value)) do meet(symbol.name) end
  end
  local used = {}
  while #open > 0 do
    for _, number in ipairs(of_symbol[table.remove(open)] or {}) do
      if not used[number] then
        used[number] = true
        for _, name in ipairs(of_equation[number]) do meet(name) end
      end
    end
  end
  return found
end

-- Every event after those whose outputs it depends on; in a loop without delay in their order.
local function sorted(events, behind)
  local by_output, list, state = {}, {}, {}
  for _, event in ipairs(events) do
    for symbol in pairs(event.reset) do by_output[symbol.name] = event end
  end
  local function place(event)
    if state[event] then return end
    state[event] = true
    for _, before in ipairs(events) do
      local needed = false
      for symbol in pairs(before.reset) do needed = needed or behind[event][symbol.name] end
      if needed and before ~= event then place(before) end
    end
    list[#list + 1] = event
  end
  for _, event in ipairs(events) do place(event) end
  return list
end

-- The events in the order in which they happen; states: the names of all that has a derivative.
function clocks.order(events, equations, states)
  local outputs, rest, last = {}, {}, {}
  for _, event in ipairs(events) do
    local list = event.phase == "output" and outputs or event.phase == "state" and last or rest
    list[#list + 1] = event
  end
  if #outputs > 1 then
    local is_state, behind = {}, {}
    for _, name in ipairs(states()) do is_state[name] = true end
    local of_equation, of_symbol = incidence(equations, is_state)
    for _, event in ipairs(outputs) do
      local values = {}
      for _, value in pairs(event.reset) do
        if type(value) ~= "number" then values[#values + 1] = value end
      end
      behind[event] = states_behind(values, is_state, of_equation, of_symbol)
    end
    outputs = sorted(outputs, behind)
  end
  local all = {}
  for _, list in ipairs { outputs, rest, last } do
    for _, event in ipairs(list) do
      event.phase = nil
      all[#all + 1] = event
    end
  end
  return all
end

return clocks
