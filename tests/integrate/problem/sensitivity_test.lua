-- Forward sensitivities against closed forms and against differences of accurate runs.
local x, y1, y2, y3 = vars "x y1 y2 y3"
local k = param "k"

test("x' = -k x: dx/dk = -t x, dx/dx0 = x/x0, by adaptive and fixed steps", function()
  local model = dae { der(x) ~ -k * x }
  local function check(options, tol)
    options.start, options.to, options.params, options.sensitivities = { x = 1 }, 2, { k = 0.5 }, { k, x }
    local sol = model:integrate(options)
    expect(sol:sensitivity(x, k, 2)):near(-2 * math.exp(-1), tol)
    expect(sol:sensitivity(x, x, 2)):near(math.exp(-1), tol)
    expect(sol:sensitivity(x, k, 1.3)):near(-1.3 * math.exp(-0.65), tol)
    expect(sol:sensitivity(k * x^2, k, 2)):near(math.exp(-2) - 2 * 0.5 * 2 * math.exp(-2), tol)
    expect(sol:gradient(x^2)):near({ -4 * math.exp(-2), 2 * math.exp(-2) }, tol)
    expect(#sol:sensitivity(x, k)):equals(#sol.t)
    expect(#sol:final()):equals(1)
  end
  check({ rtol = 1e-10, atol = 1e-12 }, 1e-9)
  check({ rtol = 1e-10, atol = 1e-12, method = "radau" }, 1e-9)
  check({ dt = 0.05, method = rk.gauss(3) }, 1e-12)        -- order 6: (0.5 · 0.05)⁶/…
end)

test("Robertson's rates as parameters of an index-1 model", function()
  local k1, k2, k3 = params "k1=0.04 k2=1e4 k3=3e7"
  local model = dae { der(y1) ~ -k1 * y1 + k2 * y2 * y3, der(y2) ~ k1 * y1 - k2 * y2 * y3 - k3 * y2^2,
    0 ~ y1 + y2 + y3 - 1 }
  local function run(params, tol, wanted)
    return model:integrate { start = { y1 = 1, y2 = 0 }, to = 40, rtol = tol, atol = tol * 1e-5,
      method = "radau", params = params,
      sensitivities = wanted }
  end
  local sol = run({}, 1e-9, { k1, k2, k3 })
  for name, value in pairs { k1 = 0.04, k2 = 1e4, k3 = 3e7 } do
    local up, down = run({ [name] = value * 1.0001 }, 1e-11), run({ [name] = value * 0.9999 }, 1e-11)
    local p = ({ k1 = k1, k2 = k2, k3 = k3 })[name]
    -- central differences: relative error 1e-8 of the curvature, 1e-11/1e-4 of the runs
    for _, unknown in ipairs { y1, y3 } do
      local slope = (up:final(unknown) - down:final(unknown)) / (2e-4 * value)
      expect(math.abs(sol:sensitivity(unknown, p, 40) / slope - 1) < 1e-6):is_true()
    end
  end
end)

test("a start that depends on the parameter through a constraint", function()
  local q = var("q", 2)
  local g, L = params "g=9.81 L=1"
  local pendulum = lagrange { q = q, T = q.dot.T * q.dot / 2, V = g * q[2], C = { (q.T * q - L^2) / 2 } }
  local function start(params)
    return pendulum:init { fix = { [q[1]] = 0.6, [q[1].dot] = 0.1 }, guess = { [q[2]] = -0.8 },
      params = params }
  end
  for _, form in ipairs { "acc", "ode" } do
    local low = pendulum:reduce(form)
    local sol = low:integrate { start = start(), to = 2, rtol = 1e-10, atol = 1e-10,
      sensitivities = { L, g } }
    for name, value in pairs { L = 1, g = 9.81 } do
      local function final(d) return low:integrate { start = start { [name] = value + d }, to = 2,
        rtol = 1e-12, atol = 1e-12 }:final(q[1]) end
      local slope = (final(1e-5) - final(-1e-5)) / 2e-5
      expect(sol:sensitivity(q[1], name == "L" and L or g, 2)):near(slope, 1e-6)
    end
  end
end)

test("what was not asked for is refused", function()
  local model = dae { der(x) ~ -k * x }
  local sol = model:integrate { start = { x = 1 }, to = 1, params = { k = 1 }, sensitivities = { x } }
  expect(function() sol:sensitivity(x, k, 1) end):fails "sensitivities = { k }"
  expect(function() model:integrate { start = { x = 1 }, to = 1, params = { k = 1 },
    sensitivities = { "u" } } end):fails "u"
  expect(function()
    model:integrate { start = { x = 1 }, to = 1, params = { k = 1 }, sensitivities = { k },
      events = { { when = x - 0.5, call = print } } }
  end):fails "events that call"
end)

local names = {}                                           -- those for tight tolerances
for _, method in ipairs(methods()) do
  if (method.order or 5) >= (method.explicit and 5 or 4) then names[#names + 1] = method.name end
end

-- x′ = 1 before x = c and 3 after: x(t) = c + 3(t - c). The same with the time as the border.
test("sensitivities jump where x' does", function()
  local c = param "c"
  for _, before in ipairs { lt(x, c), lt(t, c) } do
    for _, method in ipairs(names) do
      local sol = dae { der(x) ~ ifelse(before, 1, 3) }:integrate { start = { x = 0 }, to = 3,
        params = { c = 2 }, method = method,
                                                                    rtol = 1e-9, sensitivities = { c } }
      expect(sol(x, 3)):near(5, 1e-9)
      expect(sol:sensitivity(x, c, 1)):near(0, 1e-12)
      expect(sol:sensitivity(x, c, 3)):near(-2, 1e-9)
    end
  end
end)

-- From y = h, v = 0 with g = 2: the ball hits at t = √h with v = -2√h and is at 2e√h(t - √h) - (t - √h)²
-- after that.
test("sensitivities follow through a bounce", function()
  local y, v, e = var "y", var "v", param("e", 0.5)
  local sol = dae { der(y) ~ v, der(v) ~ -2 }:integrate {
    start = { y = 1, v = 0 }, to = 1.5, sensitivities = { e, y }, rtol = 1e-10,
    events = { { when = y, direction = -1, reset = { [v] = -e*v } } } }
  expect(sol(y, 1.5)):near(0.25, 1e-9)
  expect(sol:sensitivity(y, e, 1.5)):near(1, 1e-8)       -- 2√h(t - √h)
  expect(sol:sensitivity(y, y, 1.5)):near(0.25, 1e-8)    -- e(t - 2√h)/√h + (t - √h)/√h with h = 1
end)
