-- Form "dummy" changes its states along the way.
local x, y, u, v, lam = vars "x y u v lam"
local m, g, L = params "m=1 g=9.81 L=1"
local ball = dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -lam*x, m*der(v) ~ -lam*y - m*g, 0 ~ x^2 + y^2 - L^2 }
-- energy 32 > 2 g L: full circles
local turning = ball:init { fix = { x = 1, v = -8 }, guess = { y = 0, u = 0 } }
local energy = (u^2 + v^2)/2 + g*y

test("the pendulum turns full circles, through all quadrants, with every kind of method", function()
  local reference = ball:reduce():integrate { start = turning, to = 5, rtol = 1e-12, atol = 1e-12 }
  local quadrants = {}
  for i = 1, #reference.t do
    quadrants[(reference(x)[i] > 0 and "x" or "-x") .. (reference(y)[i] > 0 and "y" or "-y")] = true
  end
  expect(quadrants.xy and quadrants["x-y"] and quadrants["-xy"] and quadrants["-x-y"]):is_true()
  local low = ball:reduce "dummy"
  for _, run in ipairs {
    { tol = 1e-8, method = rk.gauss(3), dt = 0.005 }, { tol = 1e-6, method = rk.radau(3), dt = 0.005 },
    { tol = 1e-5, rtol = 1e-9, atol = 1e-9 },
  } do
    local tol = run.tol
    run.tol, run.start, run.to = nil, turning, 5
    local sol = low:integrate(run)
    expect(sol.status):equals "finished"
    expect(#sol:switches() > 20):is_true()
    expect(sol(x, 5)):near(reference(x, 5), tol)
    expect(sol(lam, 2.3456)):near(reference(lam, 2.3456), 100*tol)      -- between mesh points, λ ≈ 60
    expect(sol(energy, 4.321)):near(32, 100*tol)
    expect(sol(x^2 + y^2, 3.21)):near(1, 1e-9)
    expect(sol:drift().verdict):equals "kept"
  end
end)

test("switching keeps the order of the method", function()
  local low = ball:reduce "dummy"
  local exact = ball:reduce():integrate { start = turning, to = 2, rtol = 1e-12, atol = 1e-12 }(x, 2)
  local function err(dt)
    return math.abs(low:integrate { start = turning, to = 2, dt = dt, method = rk.gauss(2) }(x, 2) - exact)
  end
  local order = math.log(err(0.01)/err(0.005))/math.log(2)
  expect(order > 3.7):is_true()                                         -- 4; switches happen at other points
end)

test("times, switches and statistics belong to the whole run", function()
  local low = ball:reduce "dummy"
  local all = low:integrate { start = turning, to = 1, dt = 0.01, method = rk.gauss(3) }
  expect(#all.t):equals(101)
  for i = 2, #all.t do expect(all.t[i] > all.t[i - 1]):is_true() end
  expect(all:stats().steps):equals(100)
  local some = low:integrate { start = turning, to = 1, dt = 0.01, method = rk.gauss(3),
    times = { 0, 0.123, 0.7, 1 } }
  expect(#some.t):equals(4)
  expect(some(y)):near(all(y, { 0, 0.123, 0.7, 1 }), 1e-12)
  local list = all:switches()
  expect(list[1].t):equals(0)
  expect(list[1].states):equals "y, v"                                  -- x = 1, y = 0: x follows from y
  expect(list[2].states):equals "x, u"
  expect(tostring(all):find("states in use switched", 1, true) ~= nil):is_true()
end)

test("a start that is singular for the choice at hand", function()
  local low = ball:reduce "dummy"                                       -- chosen at a generic point: y, v
  for _, start in ipairs { { x = 0, y = -1, u = 3, v = 0 }, { x = 0, u = 3 } } do
    local sol = low:integrate { start = start, to = 1, dt = 0.005, method = rk.gauss(3) }
    expect(sol.status):equals "finished"
    expect(sol(energy, 1)):near(sol(energy, 0), 1e-9)
  end
end)

test("events see the whole model, and stop it", function()
  local low = ball:reduce "dummy"
  local sol = low:integrate { start = turning, to = 5, rtol = 1e-10, atol = 1e-10,
    events = { { when = x, direction = 1, action = "stop" } } }
  expect(sol.status):equals "event"
  expect(sol(x, sol.t[#sol.t])):near(0, 1e-9)
end)

test("a space pendulum and a double pendulum", function()
  for _, name in ipairs { "spherical_pendulum", "double_pendulum" } do
    local p = problems[name]
    local at = p:start()
    local sys = p()
    local q = sys.differential[1]
    local reference = sys:reduce():integrate { start = at, to = 2, rtol = 1e-11, atol = 1e-11 }
    local sol = sys:reduce("dummy"):integrate { start = at, to = 2, dt = 0.005, method = rk.gauss(3) }
    expect(sol.status):equals "finished"
    expect(sol(q, 2)):near(reference(q, 2), 1e-7)
  end
end)
