-- The forms of a model as a user types them: all of them move like the others.
local p = var("p", 3)
local m, g, L = params "m=1 g=9.81 L=1"
local ball = lagrange { q = p, T = m/2 * p.dot.T*p.dot, V = m*g*p[3], C = { (p.T*p - L^2)/2 } }
local at = ball:init { fix = { [p] = { .6, 0, -.8 }, [p.dot] = { .8, .5, .6 } } }

local function final(low, start)
  return low:integrate { start = start or at, to = 0.5, dt = 0.0025, method = rk.gauss(3), direct = true }
end

test("every form of the pendulum ends where form acc ends", function()
  local wanted = final(ball:reduce "acc"):final(p)
  for _, form in ipairs { "ode", "project", "baumgarte" } do
    -- order 6: the step error is below 1e-12
    expect(final(ball:reduce(form)):final(p)):near(wanted, 1e-10)
  end
  expect(final(ball:reduce("dummy", { at = at })):final(p)):near(wanted, 1e-10)
  local ggl = ball:reduce("ggl"):integrate { start = at, to = 0.5, dt = 0.0025, method = rk.radau(3),
    direct = true }
  expect(ggl:final(p)):near(wanted, 1e-9)
end)

test("eliminated multipliers and accelerations keep their values", function()
  local ode = ball:reduce "ode"
  expect(ode:index()):equals(0)
  local other = ode:init { fix = { [p] = { .6, 0, -.8 }, [p.dot] = { .8, .5, .6 } } }
  local z = ball.algebraic[1]
  expect(other(z)):near(at(z), 1e-12)
  local sol = final(ode)
  expect(sol(z, 0)):near(at(z), 1e-12)
  expect(sol(der(p[1], 2), 0)):near(at(der(p[1], 2)), 1e-12)
end)

test("baumgarte lets a violation decay, acc lets it grow along a line", function()
  local off = { [p] = { .6, 0, -.8 }, [p.dot] = { .9, .5, .6 } }
  local function violation(low) return low:integrate { start = low:init { fix = off, consistent = false },
    to = 2,
    dt = 0.01, method = rk.gauss(2) }:final((p.T*p - L^2)/2) end
  expect(violation(ball:reduce "acc")):near(0.12, 1e-6)               -- C(0) + 2 C'(0), C'(0) = 0.06
  -- 0.06 t exp(-10 t) at t = 2
  expect(math.abs(violation(ball:reduce("baumgarte", { alpha = 10 })))):near(0, 1e-7)
end)

test("reduce() names its choice; unknown forms and options are refused", function()
  local best = ball:reduce()
  expect(best.form):equals "project"
  expect(best:trace():find('reduce() chose form "project" over the explicit form "ode"', 1,
    true) ~= nil):equals(true)
  local x = var "x"
  expect(dae { der(x) ~ -x }:reduce():trace():find("left the model as it is", 1, true) ~= nil):equals(true)
  expect(function() ball:reduce "minimum" end):fails "Did you mean 'minimal'"
  expect(function() ball:reduce "minimal" end):fails "is quadratic in p, and which root holds depends"
  expect(function() ball:reduce("acc", { alpha = 1 }) end):fails "has none"
  expect(function() ball:reduce("baumgarte", { alpha = -1 }) end):fails "must be positive"
  expect(function() ball:reduce("dummy", { at = 3 }) end):fails "expected a start, got"
end)

-- A step of 1e-4 makes velocities of lengths that are known to 1e-17: rounding of 1e-13, against which some
-- terms are small.
test("ggl of the squeezing mechanism: a stall at the rounding of its terms is convergence", function()
  local p = problems.squeezer
  local at, low = p:start(), p():reduce "ggl"
  local function off(dt)
    local sol = low:integrate { start = at, to = p.to, dt = dt, method = rk.radau(3), direct = true }
    expect(sol.status):equals "finished"
    return (p:error(sol))
  end
  local coarse, fine = off(2e-4), off(1e-4)
  expect(math.log(coarse/fine, 2)):near(5, 0.1)              -- order 5 of its positions: 2s - 1
end)

test("rows that depend on each other on the solutions only: started and integrated by the derivative array",
  function()
  local x1, x2, u = var "x1", var "x2", input "u"
  local model = dae { der(x1) + u + x1 + x2 ~ 0, u + x2 + der(x2)*(der(x1) + u + x1 + x2) + u^2 ~ 0 }
  expect(function() model:reduce "acc" end):fails 'reduce "array" does not need it'
  local at = model:init { fix = { [x1] = 1 }, guess = { [x2] = 0 }, inputs = { [u] = sin(t) } }
  expect(at(der(x1))):near(-1, 1e-12)
  local sol = model:integrate { start = { [x1] = 1, [x2] = 0 }, to = 1, inputs = { [u] = sin(t) },
    rtol = 1e-8 }
  expect(sol:final(x2)):near(-math.sin(1)^2 - math.sin(1), 1e-6)
end)

test("a start of the model serves its form array, also where that is of second order", function()
  local x, y, z = vars "x y z"
  for _, unit in ipairs { 1e-3, 1, 1e3 } do
    local m = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81*unit, 0 ~ x^2 + y^2 - unit^2 }
    local at = m:init { fix = { x = unit, [der(y)] = 0 }, guess = { y = 0 } }
    local function angle(form)
      local sol = m:reduce(form):integrate { start = at, to = 1, rtol = 1e-9, atol = 1e-11*unit }
      return sol(x, 1)/unit
    end
    expect(angle "array"):near(angle "acc", 1e-7)
  end
end)

test("form array chooses its states anew where they cease to determine the rest", function()
  -- y, v_y as states: at the lowest point they do not determine x
  local x, y, z = vars "x_low y_low z_low"
  for _, L in ipairs { 1, 1e-3 } do
    local pend = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - L^2,
      start = { x_low = L*math.sin(1), [x.dot] = 0 }, guess = { y_low = -L/2 } }
    local to = 4*math.sqrt(L)
    local expected = pend:reduce "acc":integrate { to = to, rtol = 1e-11, atol = 1e-13*L }:final(x)
    for _, method in ipairs { "auto", "tsit5", "radau", "bdf", "rodas" } do
      local low = pend:reduce("array", { at = pend:init {} })
      local sol = low:integrate { to = to, rtol = 1e-8, method = method, times = { 0, to/3, to } }
      expect(sol.status):equals "finished"
      expect(sol:final(x)/L):near(expected/L, 1e-5)
      expect(#sol.t):equals(3)
      expect(#sol:switches() > 0):equals(true)
    end
  end
end)

test("the bdf methods integrate form array: x′ does not enter its algebraic equations", function()
  local x, y, z = vars "x y z"
  local sys = dae { der(x) ~ z, 0 ~ y*z + x - 1, 0 ~ y - sin(t) - 2, start = { x = 0 } }
  local at = sys:init { fix = { x = 0 } }
  local expected = sys:integrate { start = at, to = 1, method = "radau", rtol = 1e-11 }:final(x)
  for _, method in ipairs { "bdf", "rodas", "radau" } do
    local sol = sys:reduce "array":integrate { start = at, to = 1, method = method, rtol = 1e-7 }
    expect(sol.status):equals "finished"
    expect(sol:final(x)):near(expected, 1e-5)
    expect(sol:stats().steps < 200):equals(true)
  end
end)

test("a form whose rows are of highest order takes derivatives order by order to its start", function()
  -- w₁ = -sin t and its derivatives, as (y₁ + y₁³/4), …: rows of order 5 are quadratic in third derivatives
  local a, b, c, d = vars "a b c d"
  local function cubed(w) return w + w^3/4 end
  local sys = dae { 0 ~ cubed(a) + sin(t), der(cubed(a)) ~ cubed(b), der(cubed(b)) ~ cubed(c),
    der(cubed(c)) ~ cubed(d) }
  local at = sys:init { from = 0.3, guess = { a = -0.3, b = -0.8, c = 0.3, d = 0.8 } }
  local low = sys:reduce("array", { at = at })
  local sol = low:integrate { start = at, to = 1, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  expect(sol:final(cubed(d))):near(math.cos(1), 1e-5)
end)

test("form ggl in units far from 1: the multiplier has none", function()
  local x, y, v, w, z = vars "x y v w z"
  local L, g = 1e-8, 9.81e-8
  local sys = dae { der(x) ~ v, der(y) ~ w, der(v) ~ -z*x, der(w) ~ -z*y - g, 0 ~ 1e-9*(x^2 + y^2 - L^2) }
  local at = sys:init { fix = { x = 0.6*L, v = 0 }, guess = { y = -0.8*L, z = 10 } }
  local low = sys:reduce "ggl"
  local atol = { [x] = 1e-10*L, [y] = 1e-10*L, [v] = 1e-10*L, [w] = 1e-10*L }
  local sol = low:integrate { start = at, to = 1, rtol = 1e-8, atol = atol }
  local expected = sys:reduce "acc":integrate { start = at, to = 1, rtol = 1e-11, atol = atol }
  expect(sol.status):equals "finished"
  expect(sol:final(x)/L):near(expected:final(x)/L, 1e-6)
  expect(tostring(low:trace())):matches "powers of ten"
end)

test("tolerances by place and by name are those of the first choice of states", function()
  local x, y, u, v, z = vars "x_tol y_tol u_tol v_tol z_tol"
  local pend = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local at = pend:init { fix = { [x] = 1, [v] = 0 }, guess = { [y] = 0 } }
  local expected = pend:reduce():integrate { start = at, to = 3, rtol = 1e-11 }:final(x)
  for _, form in ipairs { "dummy", "array" } do
    local low = pend:reduce(form, { at = at })
    for _, atol in ipairs { { 1e-10, 1e-10 }, { [x.dot] = 1e-10, [y] = 1e-10 } } do
      local sol = low:integrate { start = at, to = 3, rtol = 1e-8, atol = atol }
      expect(sol.status):equals "finished"
      expect(#sol:switches() > 1):equals(true)
      expect(sol:final(x)):near(expected, 1e-5)
    end
  end
end)

test("form array at a start at rest, of equations of second order", function()
  local x, y, z = vars "x_rest y_rest z_rest"
  for _, unit in ipairs { { 1, 1 }, { 1e3, 1e3 }, { 1e-3, 1 } } do
    local L, T = unit[1], unit[2]
    local g = 9.81*L/T^2
    local pend = dae { der(x, 2) ~ -2*z*x, der(y, 2) ~ -2*z*y - g, 0 ~ x^2 + y^2 - L^2 }
    for _, at in ipairs { 0.6, 0, 1e-3 } do
      local start = pend:init { fix = { [x] = at*L, [x.dot] = 0 }, guess = { [y] = -L } }
      local expected = pend:reduce():integrate { start = start, to = T, rtol = 1e-11 }(x, T)
      local sol = pend:reduce("array", { at = start }):integrate { start = start, to = T, rtol = 1e-8 }
      expect(sol.status):equals "finished"
      expect(sol(x, T)/L):near(expected/L, 1e-6)
    end
  end
end)

test("form array keeps velocities where it chooses other rows, of equations of second order", function()
  local x, y, ph, th, l, m = vars "x y ph th l1 l2"   -- names decide which rows are taken
  local disc = dae { der(x, 2) - l ~ 0, der(y, 2) - m ~ 0, der(ph, 2) ~ 1,
    der(th, 2)/2 + l*cos(ph) + m*sin(ph) ~ 0,
    0 ~ der(th)*cos(ph) - der(x), 0 ~ der(th)*sin(ph) - der(y) }      -- it rolls on: th′ = 2
  local start = disc:init { fix = { [x] = 0, [y] = 0, [ph] = 0, [th] = 0, [ph.dot] = 0, [th.dot] = 2 } }
  local sol = disc:reduce("array", { at = start }):integrate { start = start, to = 3, rtol = 1e-8 }
  expect(#sol:switches() > 1):equals(true)
  expect(sol(th, 3)):near(6, 1e-6)
  expect(sol(x, 1)):near(1.95057537640069, 1e-6)  -- ∫ 2 cos(s²/2) ds
end)

test("form array that was made elsewhere chooses its rows anew at the start", function()
  local x, y, v, w, z = vars "x_el y_el v_el w_el z_el"
  local pend = dae { der(x) ~ v, der(y) ~ w, der(v) ~ -z*x, der(w) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local side = pend:init { fix = { [y] = 0, [w] = 0 }, guess = { [x] = 1 } }
  local below = pend:init { fix = { [x] = 0, [v] = 1 }, guess = { [y] = -1 } }
  local low = pend:reduce("array", { at = side })            -- states y, w, which are at rest below
  local expected = pend:reduce():integrate { start = below, to = 1, rtol = 1e-11 }:final(x)
  for _, method in ipairs { "auto", "radau", "bdf" } do
    local sol = low:integrate { start = below, to = 1, rtol = 1e-8, method = method }
    expect(sol.status):equals "finished"
    expect(sol:final(x)):near(expected, 1e-5)
  end
end)

test("form array, a table as start, at rest: rows that determine it are chosen", function()
  local x, y, u, v, z = vars "x y u v la"        -- names decide which rows are taken
  local pend = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local start = { [x] = 0.8, [y] = -0.6, [u] = 0, [v] = 0 }
  for _, low in ipairs { pend:reduce "array", pend:reduce("array", { at = pend:init { fix = start } }) } do
    expect(low:integrate { start = start, to = 1, rtol = 1e-8 }(x^2 + y^2, 1)):near(1, 1e-7)
  end
end)

-- Gains are rates: 10 in each unit of time means nothing to a pendulum in nanoseconds.
test("the default gains of baumgarte follow the model's own time", function()
  local x, y = vars "x y"
  for _, second in ipairs { 1, 1e3, 1e9, 1e-9 } do                -- in the unit of time
    local sys = lagrange { q = { x, y }, T = (x.dot^2 + y.dot^2)/2, V = 9.81/second^2*y,
      C = { x^2 + y^2 - 1 } }
    local start = sys:init { fix = { x = 0.6, [x.dot] = 0 }, guess = { y = -0.8 } }
    local low = sys:reduce "baumgarte"
    local sol = low:integrate { start = start, to = second, rtol = 1e-9 }
    expect(sol(x, second)):near(-0.59793276, 1e-7)
    expect(sol(y, second)):near(-0.80154626, 1e-7)
    expect(sol:stats().steps < 200):equals(true)
    local told = low:trace():find("for a motion in units of", 1, true) ~= nil
    expect(told):equals(second ~= 1)
  end
end)

test("so they do where speeds have names and values are parameters, in nanometres, too", function()
  local x, y, v, w, la = vars "x y v w la"
  for _, unit in ipairs { { 1, 1 }, { 1e-9, 1e-9 }, { 1e-9, 1 }, { 1e6, 1 }, { 1, 1e6 } } do
    local metre, second = 1/unit[1], 1/unit[2]                    -- in units of length and time
    local g, l = param("g", 9.81*metre/second^2), param("l", metre)
    local sys = dae { der(x) ~ v, der(y) ~ w, der(v) ~ -la*x, der(w) ~ -la*y - g, 0 ~ x^2 + y^2 - l^2 }
    local start = sys:init { fix = { x = 0.6*metre, v = 0 }, guess = { y = -0.8*metre } }
    local sol = sys:reduce "baumgarte":integrate { start = start, to = second, rtol = 1e-9 }
    expect(sol(x, second)/metre):near(-0.59793276, 1e-8)
    expect(sol(y, second)/metre):near(-0.80154626, 1e-8)
  end
end)
