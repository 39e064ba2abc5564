-- Complementarity where the start decides less than usual: kinks in the inequalities, margins of which many
-- derivatives vanish, places that are known to the errors of a run.
local x, y, u, v, la, i = vars "x y u v la i"
local methods = { "auto", "dopri5", "radau", "bdf", "rodas" }

-- A full-wave rectifier with a capacitor: v = |sin t| until tan t = -τ, then it decays until they meet again.
test("a rectifier of |sin t| conducts from 0 on, where |sin t| has a kink", function()
  local tau, t1 = 2, math.pi - math.atan(2)
  local function decay(s) return math.sin(t1)*math.exp((t1 - s)/tau) end
  for _, T in ipairs { 1, 1e-6, 1e3 } do
    local wave = sin(t/T)
    for _, source in ipairs { abs(wave), max(wave, -wave), ifelse(gt(wave, 0), wave, -wave) } do
      local sys = dae { T*der(v) ~ i - v/tau, 0 ~ min(i, v - source) }
      for _, method in ipairs(methods) do
        local sol = sys:integrate { start = { v = 0 }, to = 4*T, method = method, rtol = 1e-6 }
        expect(sol.status):equals "finished"
        expect({ sol(v, T), sol(v, 3*T), sol(v, 3.4*T), sol(v, 4*T) }):near(
          { math.sin(1), decay(3), decay(3.4), -math.sin(4) }, 1e-5)
        expect(sol(i, T)):near(math.cos(1) + math.sin(1)/tau, 1e-4)
      end
    end
  end
end)

test("a margin that leaves 0 with its fifth derivative or later is seen", function()
  for power = 1, 8 do
    local sys = dae { der(v) ~ i - v/2, 0 ~ min(i, v - t^power) }
    local sol = sys:integrate { start = { v = 0 }, to = 1, rtol = 1e-8 }
    expect(sol.status):equals "finished"
    expect({ sol(v, 1), sol(i, 1) }):near({ 1, power + 1/2 }, 1e-6)
  end
end)

test("where no regime goes on, that is said", function()
  local sys = dae { der(v) ~ i - v/2, 0 ~ min(i, v - sqrt(1 - cos(t)^2)) }
  expect(function() sys:integrate { start = { v = 0 }, to = 1 } end):fails "no regime of this piecewise model"
end)

-- On a rope: it is slack from y = (v₀²/g - 2)/3 on, the mass flies along a parabola, and the rope takes its
-- radial speed.
test("a rope that is x² + y² ≤ L² becomes taut where the run finds it, to its errors", function()
  for _, L in ipairs { 1, 1e-3, 1e3 } do
    local g = 10*L
    local sys = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -x*la, der(v) ~ -y*la - g,
      0 ~ min(L^2 - x^2 - y^2, la) }
    local px, py, speed = math.sqrt(0.75), 0.5, math.sqrt(5)
    local function flight(s) return px - py*speed*s, py + px*speed*s - 5*s^2 end
    local low, high = 0.2, 3
    for _ = 1, 100 do
      local s = (low + high)/2
      local a, b = flight(s)
      if a^2 + b^2 < 1 then low = s else high = s end
    end
    local a, b = flight(low)
    local along = py*speed*b + (px*speed - 10*low)*a
    local energy = along^2/2 + 10*b
    for _, method in ipairs { "auto", "radau", "bdf", "dopri5" } do
      for _, rtol in ipairs { 1e-3, 1e-6, 1e-9 } do
        local sol = sys:integrate { start = { x = 0, y = -L, u = L*math.sqrt(35), v = 0 }, to = 3,
          method = method, rtol = rtol }
        expect(method .. rtol .. sol.status):equals(method .. rtol .. "finished")
        expect(sol(((u^2 + v^2)/2 + g*y)/L^2, 2)):near(energy, 300*rtol)
      end
    end
  end
end)

test("borders that time decides are no regimes to search", function()
  local load, exact = 0, 0
  for k = 1, 12 do
    load = load + abs(t - k)
    exact = exact + k - 1/2                                     -- ∫₀¹ |t - k|
  end
  local sys = dae { der(x) ~ i - load, 0 ~ min(i, x) }          -- a tank that runs dry
  local sol = sys:integrate { start = { x = exact - 30 }, to = 2, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  expect({ sol(x, 2), sol(i, 1.5), sol(i, 2) }):near({ 0, 61, 56 }, 1e-6)
  local contact = dae { der(x) ~ v, der(v) ~ i - load, 0 ~ min(i, x) }
  expect(contact:integrate{ start = { x = 0, v = 0 }, to = 1 }(i, 0.5)):near(72, 1e-9)
end)

test("a regime may end where the run does", function()
  local ball = dae { der(x) ~ v, der(v) ~ la - 10, 0 ~ min(x, la) }
  for _, method in ipairs(methods) do
    for _, T in ipairs { 1, 1e-3 } do
      local fall = ball:integrate { start = { x = 5*T^2, v = 0 }, to = T, method = method, rtol = 1e-8 }
      expect(method .. fall.status):equals(method .. "finished")
      expect(fall(x/T^2, T)):near(0, 1e-7)
      local sys = dae { der(x) ~ i - 1, 0 ~ min(i, x + max(T - t, 0)) }   -- empty from T/2 on
      local sol = sys:integrate { start = { x = 0 }, to = T, method = method, rtol = 1e-8 }
      expect(method .. sol.status):equals(method .. "finished")
      expect({ sol(x, T/2)/T, sol(x, T)/T, sol(i, 3*T/4) }):near({ -1/2, 0, 2 }, 1e-7)
    end
  end
end)

-- Three diodes side by side, one of them the other way round, before a resistor: u follows v while v > 0.
test("diodes side by side start where the source is 0, in any unit", function()
  local u, a, b, c = vars "u a b c"
  for _, units in ipairs { { 1, 1 }, { 0.1, 1e-4 }, { 1e3, 1e-9 }, { 1e-6, 1e3 } } do
    local U, S = units[1], units[2]
    local v = 1.864*U*sin(1.612*t/S)
    local sys = dae { 0 ~ min(a, u - v), 0 ~ min(b, u - v), 0 ~ min(c, v - u), a + b - c ~ u/0.893 }
    for _, method in ipairs { "auto", "radau", "bdf", "dopri5" } do
      local sol = sys:integrate { start = sys:init(), to = 5*S, method = method }
      expect(method .. " " .. sol.status):equals(method .. " finished")
      for _, at in ipairs { 1, 2.5, 5 } do
        expect(sol(u, at*S)/U):near(1.864*math.sin(1.612*at), 1e-6)
        expect((sol(a, at*S) + sol(b, at*S) - sol(c, at*S))/U):near(1.864/0.893*math.sin(1.612*at), 1e-6)
      end
    end
  end
end)
