-- Nets of capacitors, resistors and diodes whose sources jump: after a jump the currents and voltages without
-- capacitors are volts away, and every method finds them.
local families = dofile "tests/families.lua"
local methods = families.with("auto")

local function net(seed)
  math.randomseed(seed)
  local random = math.random
  local nodes, span, first, second = random(1, 5), ({ 1, 10, 40 })[random(3)], 0.2 + 0.3*random(), 0.7
  local v, drawn, extra = {}, {}, {}
  for k = 1, nodes do v[k], drawn[k] = var(("v%d"):format(k)), 0 end
  local function at(k) return k == 0 and 0 or v[k] end
  local function level() return (2*random() - 1)*span end
  local function source() return ifelse(lt(t, first), level(), ifelse(lt(t, second), level(), level())) end
  local function between(i, j, current)
    if i > 0 then drawn[i] = drawn[i] + current end
    if j > 0 then drawn[j] = drawn[j] - current end
  end
  for k = 1, nodes do
    local other = random(0, k - 1)
    between(k, other, 10^(3*random() - 3)*(at(k) - at(other) - (random() < 0.5 and source() or 0)))
  end
  for _ = 1, 2*nodes do
    local i, j, Is = random(0, nodes), random(0, nodes), 10^(-random(9, 14))
    if i ~= j and random() < 0.5 then
      local w, R = var(("w%d"):format(#extra + 1)), 10^(3*random() - 1)
      extra[#extra + 1] = w ~ Is*(exp((at(i) - at(j) - source() - R*w)/0.026) - 1)
      between(i, j, w)
    elseif i ~= j then
      between(i, j, Is*(exp((at(i) - at(j))/0.026) - 1))
    end
  end
  local equations, start = {}, {}
  for k = 1, nodes do
    local stores = k == 1 or random() < 0.3
    equations[k] = 10^(3*random() - 3)*(stores and der(v[k]) or 0) ~ -drawn[k]
    if stores then start[v[k]] = 0 end
  end
  for _, one in ipairs(extra) do equations[#equations + 1] = one end
  return dae(equations), start, v[1]
end

test("methods agree behind two jumps, on 24 nets", function()
  for seed = 1, 24 do
    local sys, start, v = net(seed)
    local first
    for _, method in ipairs(methods) do
      local sol = sys:integrate { to = 1, start = start, method = method, rtol = 1e-7, atol = 1e-9 }
      expect(sol.status):equals "finished"
      first = first or sol(v, 1)
      expect(sol(v, 1)):near(first, 3e-5*(math.abs(first) + 0.01))    -- some hundred steps' errors
    end
  end
end)

-- v′ falls from 10⁹¹ to 1 in the iteration, and beside it every step of the voltage looks like rounding.
test("an iteration that comes down an exponential does not stop on its way", function()
  local v, u, w = vars "v u w"
  local E, F = ifelse(lt(t, 0.636), -3.12, 6.24), ifelse(lt(t, 0.636), 9.23, 9.68)
  local diode = 1e-14*(exp(40*(u - v)) - 1)
  local sys = dae { 0.697*der(v) ~ 0.18*(u - v - E) + diode - 0.0057*v, 0 ~ 0.18*(u - v - E) - w + diode,
    w ~ 1e-14*(exp(40*(-u - 57.5*w - F)) - 1) }
  for _, method in ipairs(methods) do
    local sol = sys:integrate { to = 1, start = { [v] = 0 }, method = method }
    expect(sol.status):equals "finished"
    local drop = sol(u, 1) - sol(v, 1)
    expect(0.18*(drop - 6.24) + 1e-14*math.exp(40*drop)):near(0, 1e-4)
  end
end)

-- Pumps at changing pressures, valves that open and close, and pipes with K (q |q| + q/100). Behind a closed
-- valve q is 0, on the border of |q|.
local function pipes(seed)
  math.randomseed(seed)
  local random = math.random
  local function level(low, high) return low*(high/low)^random() end
  local nodes, unit, p, inflow, equations, start = random(2, 5), 10^random(0, 5), {}, {}, {}, {}
  for k = 1, nodes do p[k], inflow[k] = var(("p%d"):format(k)), 0 end
  local function pump() return unit*ifelse(lt(t, 0.4), level(0.1, 10), level(0.1, 10)) end
  local flows = 0
  for k = 1, nodes do
    for _ = 1, random(1, 2) do
      local from, resistance = random(0, k - 1), level(0.01, 100)
      if random() < 0.4 then resistance = ifelse(lt(t, 0.7), resistance, level(0.01, 1e3)) end
      flows = flows + 1
      local q = var(("q%d"):format(flows))
      equations[#equations + 1] = (from == 0 and pump() or p[from]) - p[k]
        ~ resistance*unit*(q*abs(q) + 0.01*q)
      inflow[k] = inflow[k] + q
      if from > 0 then inflow[from] = inflow[from] - q end
    end
  end
  for k = 1, nodes do
    local leak = level(0.01, 0.5)*p[k]/unit
    if k == nodes or random() < 0.3 then
      equations[#equations + 1] = level(0.03, 1)/unit*der(p[k]) ~ inflow[k] - leak
      start[p[k]] = 0
    else
      equations[#equations + 1] = 0 ~ inflow[k] - leak*(random() < 0.5 and 1 or ifelse(lt(t, 0.5), 0, 1))
    end
  end
  return dae(equations), start, p[nodes], unit
end

test("flows that turn when pumps and valves switch, on 12 nets of pipes", function()
  for seed = 1, 12 do
    local sys, start, p, unit = pipes(seed)
    local first
    for _, method in ipairs(methods) do
      local sol = sys:integrate { to = 1, start = start, method = method, rtol = 1e-7, atol = 1e-9 }
      expect(sol.status):equals "finished"
      first = first or sol(p, 1)
      expect(sol(p, 1)/unit):near(first/unit, 3e-5*(math.abs(first)/unit + 0.01))
    end
  end
end)

-- Implicit Euler by hand: with x fixed in a step, w + 0.026/(10 + dt) log(w/1e-9 + 1) = (U - x)/(10 + dt).
test("methods with steps of one length find currents behind a jump", function()
  local x, w = vars "x w"
  local U = ifelse(lt(t, 0.995), 0, 5)
  local sys = dae { der(x) ~ w - x, w ~ 1e-9*(exp((U - x - 10*w)/0.026) - 1) }
  for _, method in ipairs { rk.implicit_euler, rk.radau(2), rk.sdirk2 or rk.gauss(2), "rk4" } do
    local sol = sys:integrate { to = 2, dt = 0.01, start = { [x] = 0 }, method = method }
    expect(sol.status):equals "finished"
    for _, time in ipairs { 1, 1.5, 2 } do
      local current, voltage = sol(w, time), 5 - sol(x, time)
      expect(10*current + 0.026*math.log(current/1e-9 + 1)):near(voltage, 1e-6)
    end
  end
end)
