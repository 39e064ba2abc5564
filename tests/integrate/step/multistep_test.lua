-- BDF with fixed steps, and index 2 as it stands: observed orders.
local x, y, y1, y2, z = vars "x y y1 y2 z"

local function slope(error_at, dt)
  return math.log(error_at(dt) / error_at(dt / 2), 2)
end

test("bdf(k) converges with order k on a nonlinear ODE and on an index-1 model", function()
  local ode = dae { der(x) ~ x * y, der(y) ~ -log(x) }
  local index1 = dae { der(x) ~ x * y, 0 ~ y^3 + y - x - t^2 }
  local start = index1:init { fix = { x = 0.5 }, guess = { y = 0.4 } }
  local exact = index1:integrate { start = start, to = 1, method = rk.gauss(6), dt = 1 / 32 }:final(x)
  for k = 1, 6 do
    local dt = k < 5 and 1 / 64 or 1 / 32
    expect(slope(function(h) return math.abs(ode:integrate { start = { x = 1, y = 1 }, to = 1,
      method = bdf(k), dt = h }:final(x) - math.exp(math.sin(1))) end, dt)
      >= k - 0.25):is_true()
    expect(slope(function(h) return math.abs(index1:integrate { start = start, to = 1, method = bdf(k),
      dt = h }:final(x) - exact) end, 1 / 64)
      >= k - 0.25):is_true()
  end
end)

test("Jay's index-2 problem as it stands: the orders of y and z", function()
  local jay = dae { der(y1) ~ y1 * y2 * z, der(y2) ~ y1^2 * y2^2 - 3 * y2^2 * z, 0 ~ y1^2 * y2 - 1 }
  local start = jay:init { fix = { y1 = 1 }, guess = { y2 = 1, z = 1 } }
  local function errors(method, h)
    local sol = jay:integrate { start = start, to = 1, method = method, dt = h, direct = true }
    return math.max(math.abs(sol:final(y1) - math.exp(1)), math.abs(sol:final(y2) - math.exp(-2))),
      math.abs(sol:final(z) - math.exp(2))
  end
  -- Hairer, Lubich & Roche 1989: Radau IIA with s stages y 2s - 1, z s; BDF k: k and k.
  for method, orders in pairs { [rk.radau(2)] = { 3, 2 }, [rk.radau(3)] = { 5, 3 }, [bdf(2)] = { 2, 2 },
    [bdf(3)] = { 3, 3 } } do
    local y_coarse, z_coarse = errors(method, 1 / 40)
    local y_fine, z_fine = errors(method, 1 / 80)
    expect(math.log(y_coarse / y_fine, 2)):near(orders[1], 0.15 / orders[1])
    expect(math.log(z_coarse / z_fine, 2)):near(orders[2], 0.15 / orders[2])
  end
end)

test("adaptive with direct = true: index 2 and 3 meet the tolerance", function()
  local jay = dae { der(y1) ~ y1 * y2 * z, der(y2) ~ y1^2 * y2^2 - 3 * y2^2 * z, 0 ~ y1^2 * y2 - 1 }
  local start = jay:init { fix = { y1 = 1 }, guess = { y2 = 1, z = 1 } }
  for _, method in ipairs { "radau", "bdf" } do
    local sol = jay:integrate { start = start, to = 1, method = method, rtol = 1e-8, atol = 1e-8,
      direct = true }
    expect(sol:final(y1)):near(math.exp(1), 2e-6)
    expect(sol:final(z)):near(math.exp(2), 1e-4)
  end
  local q = var("q", 2)
  local pendulum = lagrange { q = q, T = q.dot.T * q.dot / 2, V = 9.81 * q[2], C = { (q.T * q - 1) / 2 } }
  local at = pendulum:init { fix = { [q] = { 1, 0 }, [q.dot] = { 0, 0 } } }
  local sol = pendulum:integrate { start = at, to = 10, method = "radau", rtol = 1e-8, atol = 1e-8,
    direct = true }
  -- docs/benchmarks.md#pendulum
  expect(sol:final(q)):near({ 0.275087462576115, -0.961419205099125 }, 1e-6)
end)

test("unknowns of index 3 and more, which no step tests, are named", function()
  local x1, x2, v1, v2, F = vars "x1 x2 v1 v2 F"
  -- A force on one of two masses, such that the other follows a path: index 4 (the damper sees its speed).
  local servo = dae { der(x1) ~ v1, der(x2) ~ v2, 100*der(v1) ~ F - 5*(x1 - x2) - 3*(v1 - v2),
    10*der(v2) ~ 5*(x1 - x2) + 3*(v1 - v2), 0 ~ x2 - (1 - cos(t))/2 }
  local start = servo:init { guess = { x1 = 0 } }
  local exact = servo:reduce():integrate { start = start, to = 3, rtol = 1e-10, method = "radau" }
  local direct = servo:integrate { start = start, to = 3, method = "bdf", rtol = 1e-6, direct = true }
  expect(direct:final(x1)):near(exact:final(x1), 1e-4)
  expect(math.abs(direct:final(F)/exact:final(F) - 1) > 0.1):is_true()  -- why it has to be said
  expect(direct:stats().untested):matches "no step tests the error of v1, F, of index up to 4"
  expect(tostring(direct)):matches "divided by h%^3"
  local jay = dae { der(y1) ~ y1 * y2 * z, der(y2) ~ y1^2 * y2^2 - 3 * y2^2 * z, 0 ~ y1^2 * y2 - 1 }
  local at = jay:init { fix = { y1 = 1 }, guess = { y2 = 1, z = 1 } }
  expect(jay:integrate { start = at, to = 1, method = "bdf", direct = true }:stats().untested):equals ""
  expect(servo:reduce():integrate { start = start, to = 3 }:stats().untested):equals ""
end)

test("dense output and times of fixed-step BDF", function()
  local decay = dae { der(x) ~ -x }
  local sol = decay:integrate { start = { x = 1 }, to = 1, dt = 0.01, method = bdf(4),
    times = { 0, 0.5, 0.755, 1 } }
  expect(sol.t):near({ 0, 0.5, 0.755, 1 }, 0)
  for _, at in ipairs { 0.333, 0.755 } do expect(sol(x, at)):near(math.exp(-at), 1e-8) end
  expect(sol:stats().steps):equals(100)
  expect(function() decay:integrate { start = { x = 1 }, to = 1, dt = 0, method = bdf(4) } end):fails "dt = 0"
end)

test("verify() measures the order of every formula", function()
  for k = 1, 6 do
    local v = bdf(k):verify()
    expect(v.ok):is_true()
    for _, row in ipairs(v.rows) do expect(row.expected):equals(row.problem == "index 3" and math.min(k, 4)
      or k) end
  end
  expect(tostring(bdf(5):verify())):matches "index 3: the start by Radau steps limits it"
end)
