-- Where equations as they are written are not defined: a run ends there and says why, whatever the method.
local families = dofile "tests/families.lua"
local x, y, z, a = vars "x y z a"
local part_of = dofile "tests/part_of.lua"
local methods = families.with("auto", "dopri5", "dop853", "tsit5")
local taken = part_of(3)
local tolerances = { 1e-3, 1e-4, 1e-6, 1e-8, 1e-10 }

local function stops(name, equations, start, exact, factor, only)
  test(name, function()
    local sys = dae(equations)
    for _, method in ipairs(only or methods) do
      for _, rtol in ipairs(tolerances) do
        if taken() then
          local sol = sys:integrate { start = start, to = 2.5*exact, rtol = rtol, method = method }
          local at = method .. " " .. rtol .. " "
          expect(at .. sol.status):matches "stopped at t = "
          local named = false
          for _, words in ipairs { " = 0 there, and ", " is almost 0 there; where it", " is only 0.0" } do
            named = named or sol.status:find(factor .. words, 1, true) ~= nil
          end
          expect(named):equals(true)
          if rtol < 1e-5 then expect(sol.t[#sol.t]):near(exact, 1e-3*exact) end
        end
      end
    end
  end)
end

stops("x' = -1/x² reaches 0 at 1/3", { der(x) ~ -1/x^2 }, { x = 1 }, 1/3, "x")
stops("the same, a thousand times smaller", { der(x) ~ -1e-9/x^2 }, { x = 1e-3 }, 1/3, "x")
stops("the same from below", { der(x) ~ 1/x^2 }, { x = -1 }, 1/3, "x")
stops("x' = -1/x", { der(x) ~ -1/x }, { x = 1 }, 1/2, "x")
stops("x' = 1/(2 - x)", { der(x) ~ 1/(2 - x) }, { x = 1 }, 1/2, "2 - x")
stops("x' = -1/sin x", { der(x) ~ -1/sin(x) }, { x = 1 }, 1 - math.cos(1), "sin(x)")
stops("x' = -1/(x (1 + x²))", { der(x) ~ -1/(x*(1 + x^2)) }, { x = 1 }, 3/4, "x")
stops("a pole on the way of another unknown", { der(x) ~ -1, der(y) ~ 1/x }, { x = 1, y = 0 }, 1, "x")
stops("a pole in time", { der(y) ~ 1/(t - 1) }, { y = 0 }, 1, "t - 1")
test("a pole in time is not passed by steps of a few units in the last place", function()
  local sys = dae { der(y) ~ 1/(t - 1) }
  for k = 1, 60 do
    for _, method in ipairs { "tsit5", "dopri5", "verner98" } do
      local sol = sys:integrate { start = { y = 0 }, to = 2.5, rtol = 1e-3*(1 + k/20), method = method }
      expect(method .. " " .. k .. " " .. sol.status):matches "stopped at t = 1: "
    end
  end
end)
stops("a tangent", { der(x) ~ 1, der(y) ~ tan(x) }, { x = 0, y = 0 }, math.pi/2, "cos(x)")
stops("an algebraic unknown", { der(x) ~ -1, der(y) ~ z, 0 ~ z - 1/x }, { x = 1, y = 0 }, 1, "x")
stops("an algebraic unknown, implicitly", { der(x) ~ -z, 0 ~ z*x^2 - 1 }, { x = 1 }, 1/3, "x")
for _, k in ipairs { 0.3, 1/3, -0.7, 12 } do
  local factor = tostring(x + k)
  stops("x' = -1/(x + " .. k .. ")", { der(x) ~ -1/(k + x) }, { x = 1 - k }, 1/2, factor)
  stops("the same with x' implicit, " .. k, { (k + x)*der(x) ~ -1 }, { x = 1 - k }, 1/2, factor,
    { "auto", "dopri5", "radau", "gauss", "bdf" })
  stops("the same with an algebraic unknown, " .. k, { der(x) ~ -z, z*(k + x) ~ 1 }, { x = 1 - k }, 1/2,
    factor)
end
stops("a logarithm", { der(x) ~ log(x) - 1 }, { x = 1 }, 0.59634736232319, "x")   -- -e Ei(-1)
stops("a root", { der(x) ~ -sqrt(x) - 1 }, { x = 1 }, 2 - 2*math.log(2), "x")
stops("an inverse sine", { der(x) ~ 1, der(y) ~ asin(x) }, { x = 0, y = 0 }, 1, "1 - x²")

test("fixed steps end at poles, too", function()
  for _, method in ipairs { rk.dopri5, rk.radau(3), rk.gauss(2) } do
    local cubic = dae { der(x) ~ -1/x^2 }
    local sol = cubic:integrate { start = { x = 1 }, to = 2, dt = 0.003, method = method }
    expect(sol.status):matches "stopped at t = 0.3"
    local sol = dae { der(x) ~ -1, der(y) ~ 1/x }:integrate { start = { x = 1, y = 0 }, to = 2, dt = 0.003,
      method = method }
    expect(sol.status):matches "x = 0 there, and 1/x is not defined"
    expect(sol.t[#sol.t]):near(1, 0.004)
  end
end)

-- cos(k/x) has no limit at 0. The solution is there at ∫ dx/(1 - cos(k/x)/2) from 0 to 0.8, which x = k/s
-- makes k ∫ ds/(s² (1 - cos(s)/2)) from k/0.8 to infinity: by Simpson's rule over periods of s; behind the
-- last one, the mean of 1/(1 - cos(s)/2) is 2/√3. What tends to 0 with x, as x sin(1/x), goes on (below).
test("what swings without end where a divisor vanishes has no value there", function()
  local k, n, periods = 0.01, 400, 2000
  local function f(s) return 1/(s^2*(1 - math.cos(s)/2)) end
  local from, sum = k/0.8, 0
  local function simpson(low, high, count)
    local h, total = (high - low)/count, f(low) + f(high)
    for i = 1, count - 1 do total = total + (i % 2 == 1 and 4 or 2)*f(low + i*h) end
    return total*h/3
  end
  sum = simpson(from, 10*from, 20000) + simpson(10*from, 2*math.pi, 20000)
  for i = 1, periods do sum = sum + simpson(2*math.pi*i, 2*math.pi*(i + 1), n) end
  local exact = k*(sum + 2/math.sqrt(3)/(2*math.pi*(periods + 1)))
  for _, case in ipairs { { cos(k/x)/2 - 1, 0.8 }, { 1 - cos(k/x)/2, -0.8 } } do
    for _, method in ipairs { "auto", "dopri5", "dop853", "tsit5", "radau", "bdf" } do
      local sol = dae { der(x) ~ case[1] }:integrate { start = { x = case[2] }, to = 3, rtol = 1e-4,
        method = method, max_steps = 50000 }
      expect(method .. " " .. sol.status):matches "stopped at t = .*x = 0 there, and 0.01/x is not defined"
      expect(sol.t[#sol.t]):near(exact, 1e-3)
    end
  end
  for part = -18, 18, 9 do                              -- not by luck
    for _, method in ipairs { "dop853", "tsit5" } do
      local sol = dae { der(x) ~ cos(k/x)/2 - 1 }:integrate { start = { x = 0.8 }, to = 3,
        rtol = 1e-4*(1 + part/1000), method = method, max_steps = 50000 }
      expect(sol.status):matches "stopped at t = .*x = 0 there, and 0.01/x is not defined"
    end
  end
end)

test("what is bounded where a divisor vanishes goes on", function()
  local models = {
    { sin(x)/x },
    { (1 - cos(x))/x^2 }, { x^3/(2*x) }, { (exp(x) - 1)/x }, { (x - sin(x))/x^3 }, { sqrt(1 + x^2)/(2 + x) },
    { ifelse(lt(abs(x), 0.1), 1 - x^2/6, sin(x)/x) }, { 1/(1 + 1/x^2) }, { x*log(abs(x)) },
    { ifelse(lt(x, 2), 1, 1/x) }, { log(x^2 + 0.01) }, { atan(1/x) }, { x*sin(1/x) },
    { log(abs(x)) }, { abs(x)^0.3*cos(x)/(1 + 1/x^2) } }
  for _, model in ipairs(models) do
    for _, method in ipairs(methods) do
      local sys = dae { der(x) ~ 1, der(y) ~ model[1] }
      local sol = sys:integrate { start = { x = -0.7345, y = 0 }, to = 1.7345, rtol = 1e-6, method = method }
      expect(method .. " " .. sol.status):equals(method .. " finished")
    end
  end
end)

test("a pole in a branch that is not in force is none", function()
  local m = dae { der(x) ~ cos(t), der(y) ~ ifelse(gt(abs(x), 0.2), 1/x, 25*x) }
  for _, method in ipairs(methods) do
    expect(m:integrate { start = { x = 0, y = 0 }, to = 10, method = method }.status):equals "finished"
  end
end)

test("guards = false goes on", function()
  local sol = dae { der(x) ~ -1, der(y) ~ 1/x }:integrate { start = { x = 1.05, y = 0 }, to = 2, dt = 0.1,
    guards = false, method = rk.rk4 }
  expect(sol.status):equals "finished"
end)

test("a divisor that touches 0 at its own border ends a run, behind it and at its end", function()
  local divisors = { max(x, -x), ifelse(lt(x, 0), -x, x), min(abs(x), 1), abs(x) + x^2, abs(x) }
  for k, divisor in ipairs(divisors) do
    local sys = dae { divisor*z ~ 1, der(x) ~ 1 }
    for _, method in ipairs(methods) do
      for _, to in ipairs { 1, 2 } do
        local sol = sys:integrate { start = { x = -1 }, to = to, method = method }
        expect(k .. method .. to .. sol.status):matches "stopped at t = 1: "
        expect(sol.t[#sol.t]):near(1, 1e-5)
      end
    end
  end
end)

test("a divisor that touches 0 at its own border does so in every unit, and where a step is halved", function()
  for _, size in ipairs { 1, 1e-9, 1e9 } do
    for _, time in ipairs { 1, 1e-6, 1e6 } do
      local sys = dae { max(x, -x)*z ~ 1, der(x) ~ size/time }
      local sol = sys:integrate { start = { x = -size }, to = 2*time }
      expect(sol.status):matches "stopped at t = "
      expect(sol.t[#sol.t]/time):near(1, 1e-4)
    end
  end
end)

test("a divisor that comes near 0 at its border does not", function()
  local sys = dae { (max(x, -x) + 1e-3)*z ~ 1, der(x) ~ 1 }
  for _, method in ipairs(methods) do
    local sol = sys:integrate { start = { x = -1 }, to = 2, method = method }
    expect(sol.status):equals "finished"
    expect(sol(z, 2)):near(1/1.001, 1e-6)
  end
  local falling = dae { exp(-t)*z ~ 1, der(x) ~ x - 1/z }  -- 0 to rounding, but never 0
  expect(falling:integrate { start = { x = 1 }, to = 36 }.status):equals "finished"
end)
