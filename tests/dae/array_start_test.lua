-- Starts of models whose Jacobian has rows that look alike: d of a diode is in all of them by a slope of
-- 10⁹, and what is new in a row is 1 beside it.
local c1, c2, i, d = vars "c1 c2 i d"

local function rectifier(C, saturation, volts)
  local I = saturation*(exp(d/0.026) - 1)
  return dae { 0.3*C*der(c1) ~ I - i - c1/1000, 0.7*C*der(c2) ~ i, c1 ~ c2,
    d ~ volts*sin(120*pi*t) - c1 - I }
end

--- d + c = v - I(d), by bisection
local function exact(v, c, saturation)
  local low, high = v - c - 100, v - c + 100
  for _ = 1, 200 do
    local mid = (low + high)/2
    local over = mid + c - v + saturation*(math.exp(math.min(mid/0.026, 600)) - 1)
    if over > 0 then high = mid else low = mid end
  end
  return low
end

test("form array of two capacitors side by side behind a diode starts anywhere", function()
  for _, C in ipairs { 1, 1e-4, 100 } do
    for _, saturation in ipairs { 1e-12, 1e-9, 1e-15 } do
      local form = rectifier(C, saturation, 15):reduce "array"
      for _, time in ipairs { 0, 1e-5, 7e-5, 1e-4, 1e-3, 4e-3, 6e-3 } do
        for _, c in ipairs { 0, 2.2e-10, 1e-5, 0.3 } do
          local at = form:init { fix = { c1 = c }, from = time }
          expect(at(d)):near(exact(15*math.sin(120*math.pi*time), c, saturation), 1e-9)
          expect(at(der(c1) - der(c2))):near(0, 1e-6)
          expect(at(d - 15*sin(120*pi*t) + c1 + 0.3*C*der(c1) + i + c1/1000)):near(0, 1e-6)
        end
      end
    end
  end
end)

test("and runs as the other forms do", function()
  for _, C in ipairs { 1, 0.01, 10 } do
    local sys = rectifier(C, 1e-12, 15)
    local right = sys:reduce "acc" :integrate { start = { c1 = 0 }, to = 0.05, rtol = 1e-10 }
    for _, method in ipairs { "auto", "radau", "bdf", "dopri5", "rodas" } do
      for _, rtol in ipairs { 1e-3, 1e-5, 1e-8 } do
        local sol = sys:reduce "array" :integrate { start = { c1 = 0 }, to = 0.05, rtol = rtol,
          method = method }
        expect(sol.status):equals "finished"
        expect(sol:final(c1)/right:final(c1)):near(1, 100*rtol)
      end
    end
  end
end)

-- y is 1 to the error of the solution: y - 1 is no slope of z, however its row is scaled.
test("a slope that is 0 where the solution is stays one", function()
  local x, y, z = vars "x y z"
  for _, size in ipairs { 1, 1e-9, 1e9 } do
    local sys = dae { der(x) ~ -x, 0 ~ (y - 1)^2*1e-3 + y - 1 - x, 0 ~ (y - 1)*z/size }
    expect(function() sys:init { fix = { x = 0 } } end):fails "The equations are singular here"
  end
end)

-- Rows that were chosen at a moving point determine nothing at rest: others are chosen at the start.
test("form array made at a point of its own starts at rest", function()
  local x, y, u, v, la = vars "x y u v la"
  for _, pull in ipairs { 0, sign(x*v - y*u)/2 } do
    local pendulum = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -la*x + pull*y,
      der(v) ~ -la*y - 9.81 - pull*x, 0 ~ x^2 + y^2 - 1 }
    local form = pendulum:reduce "array"
    local at = pendulum:init { fix = { x = 0.6, u = 0 }, guess = { y = -0.8 } }
    local right = pendulum:reduce "acc" :integrate { start = at, to = 2, rtol = 1e-10 } :final(x)
    local again = form:init { fix = { x = 0.6, u = 0 }, guess = { y = -0.8 } }
    expect(again(der(u))):near(at(der(u)), 1e-12)
    for _, start in ipairs { at, again, { x = 0.6, u = 0, y = -0.8 } } do
      local sol = form:integrate { start = start, to = 2, rtol = 1e-8 }
      expect(sol.status):equals "finished"
      expect(sol:final(x)):near(right, 1e-6)
    end
    local linear = form:linearize(at)
    expect(#linear.states):equals(2)
  end
end)

test("a sweep in form array chooses the rows that its start needs", function()
  local x, y, u, v, la = vars "x y u v la"
  local m, g = param("m", 1), param("g", 9.81)
  local pendulum = dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -la*x, m*der(v) ~ -la*y - g*m,
    0 ~ x^2 + y^2 - 1 }
  local at = pendulum:init { fix = { x = 0.6, u = 0 }, guess = { y = -0.8 } }
  local values = { m = { 1, 2, 3 }, g = { 5, 9.81, 20 } }
  for _, start in ipairs { at, { x = 0.6, u = 0, y = -0.8 } } do
    local found = sweep(pendulum:reduce "array", { start = start, to = 1, params = values, rtol = 1e-8 })
    for k = 1, 3 do
      local right = pendulum:with { m = values.m[k], g = values.g[k] } :reduce "acc"
        :integrate { start = { x = 0.6, u = 0, y = -0.8 }, to = 1, rtol = 1e-10 }
      expect(found[k].status):equals "finished"
      expect(found[k]:final(x)):near(right:final(x), 1e-6)
      expect(found[k]:final(la)):near(right:final(la), 1e-4)
    end
  end
end)
