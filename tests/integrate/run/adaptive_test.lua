-- Integration with chosen steps: published end values, tolerances met, events, refusals.
local x, y, v = vars "x y v"
local decay = dae { der(x) ~ -2 * x }
local van_der_pol = dae { der(x) ~ y, der(y) ~ 5 * (1 - x^2) * y - x }
local vdp_end = { 1.747561006961, -0.167270372278 }

local function worst(sol, reference)                       -- largest relative error of the final values
  local largest = 0
  for e, value in pairs(reference) do largest = math.max(largest, math.abs(sol:final(e) / value - 1)) end
  return largest
end

local names = {}                                           -- those for tight tolerances
for _, method in ipairs(methods()) do
  if (method.order or 5) >= (method.explicit and 5 or 4) then names[#names + 1] = method.name end
end

test("a tolerance is met by every pair: x' = -2x and the Van der Pol oscillator", function()
  for _, method in ipairs(names) do
    local sol = decay:integrate { start = { x = 1 }, to = 2, method = method, rtol = 1e-8, atol = 1e-10 }
    expect(sol.status):equals "finished"
    local slack = method == "bdf" and 10 or 1              -- some 200 steps, errors of one sign add up
    expect(sol:final(x)):near(math.exp(-4), 1e-8 * slack)
    expect(sol(x, 1.234)):near(math.exp(-2.468), 1e-8 * slack)
    for _, tol in ipairs { 1e-5, 1e-8 } do
      local run = van_der_pol:integrate { start = { x = 2, y = 0 }, to = 25, method = method, rtol = tol,
        atol = tol }
      -- The flow contracts but for the phase; a hundred local errors may add up.
      expect(run:final(vec { x, y })):near(vdp_end, 100 * slack * tol)
    end
  end
end)

test("Robertson's reaction over ten decades", function()
  local y1, y2, y3 = vars "y1 y2 y3"
  local model = dae { der(y1) ~ -0.04 * y1 + 1e4 * y2 * y3, der(y2) ~ 0.04 * y1 - 1e4 * y2 * y3 - 3e7 * y2^2,
    0 ~ y1 + y2 + y3 - 1 }
  local sol = model:integrate { start = { y1 = 1, y2 = 0 }, to = 4e10, method = "radau", rtol = 1e-10,
    atol = 1e-18 }
  expect(worst(sol, { [y1] = 5.2083451767992389e-8, [y2] = 2.0833381779254889e-13 }) < 1e-8):is_true()
  expect(sol:stats().steps < 300):is_true()                -- 118: the order rises to 13
  local loose = model:integrate { start = { y1 = 1, y2 = 0 }, to = 4e7, method = "radau", rtol = 1e-6,
    atol = { y1 = 1e-8, y2 = 1e-12, y3 = 1e-8 } }
  expect(worst(loose, { [y1] = 5.2030718441205470e-5, [y2] = 2.0813357318925326e-10,
    [y3] = 0.99994796907342522 }) < 2e-4):is_true()        -- atol of y1 beside its value; 10⁻⁵ are left
end)

test("HIRES and the chemical Akzo Nobel problem", function()
  local u = var("u", 8)
  local r = 280 * u[6] * u[8]
  local hires = dae { der(u[1]) ~ -1.71*u[1] + .43*u[2] + 8.32*u[3] + .0007,
    der(u[2]) ~ 1.71*u[1] - 8.75*u[2],
    der(u[3]) ~ -10.03*u[3] + .43*u[4] + .035*u[5], der(u[4]) ~ 8.32*u[2] + 1.71*u[3] - 1.12*u[4],
    der(u[5]) ~ -1.745*u[5] + .43*(u[6] + u[7]), der(u[6]) ~ -r + .69*u[4] + 1.71*u[5] - .43*u[6] + .69*u[7],
    der(u[7]) ~ r - 1.81*u[7], der(u[8]) ~ -r + 1.81*u[7] }
  local reference = { .7371312573325668e-3, .1442485726315e-3, .5888729740967575e-4, .1175651343283149e-2,
    .2386356198831331e-2, .6238968252742796e-2, .2849998395185769e-2, .2850001604814231e-2 }
  local sol = hires:integrate { start = { [u] = { 1, 0, 0, 0, 0, 0, 0, .0057 } }, to = 321.8122,
    method = "radau", rtol = 1e-8, atol = 1e-11 }
  for i = 1, 8 do expect(math.abs(sol:final(u[i]) / reference[i] - 1) < 1e-5):is_true() end
  local a = var("a", 6)
  local r1, r2, r3 = 18.7*a[1]^4*sqrt(a[2]), 0.58*a[3]*a[4], 0.58/34.4*a[1]*a[5]
  local r4, r5, F = 0.09*a[1]*a[4]^2, 0.42*a[6]^2*sqrt(a[2]), 3.3*(0.9/737 - a[2])
  local akzo = dae { der(a[1]) ~ -2*r1+r2-r3-r4, der(a[2]) ~ -r1/2-r4-r5/2+F, der(a[3]) ~ r1-r2+r3,
    der(a[4]) ~ -r2+r3-2*r4,
    der(a[5]) ~ r2-r3+r5, 0 ~ 115.83*a[1]*a[4] - a[6] }
  local ends = { 0.1150794920661702, 0.1203831471567715e-2, 0.1611562887407974, 0.3656156421249283e-3,
    0.1708010885264404e-1, 0.4873531310307455e-2 }
  local run = akzo:integrate { start = { [a:slice(1, 5)] = { 0.444, 0.00123, 0, 0.007, 0 } }, to = 180,
    method = "radau", rtol = 1e-8, atol = 1e-10 }
  for i = 1, 6 do expect(math.abs(run:final(a[i]) / ends[i] - 1) < 1e-7):is_true() end
end)

test("a ball bounces at the times of the formula", function()
  local ball = dae { der(y) ~ v, der(v) ~ -9.81 }
  local bounce = { when = y, direction = -1, reset = { [v] = -0.9 * v } }
  for _, method in ipairs { "dopri5", "radau" } do
    local sol = ball:integrate { start = { y = 1, v = 0 }, to = 3, method = method, events = { bounce } }
    expect(sol.status):equals "finished"
    expect(#sol.events):equals(4)
    local t, speed = math.sqrt(2 / 9.81), math.sqrt(2 * 9.81)
    for _, event in ipairs(sol.events) do
      expect(event.t):near(t, 4e-15)                       -- a parabola: the methods are exact on it
      expect(event.values.v):near(-speed, 1e-13)
      expect(event.after.v):near(0.9 * speed, 1e-13)
      t, speed = t + 2 * 0.9 * speed / 9.81, 0.9 * speed
    end
  end
  local zeno = ball:integrate { start = { y = 1, v = 0 }, to = 3, method = "dopri5",
    events = { { when = y, direction = -1, reset = { [v] = -0.5 * v } } } }
  expect(zeno.status):matches "^stopped at t = 1.35457: the events y = 0 accumulate"
  expect(zeno.t[zeno.t.rows]):near(3 * math.sqrt(2 / 9.81), 1e-7)
end)

test("events stop, call and record", function()
  local wave = dae { der(x) ~ y, der(y) ~ -x }
  local seen = {}
  local sol = wave:integrate { start = { x = 0, y = 1 }, to = 20, rtol = 1e-10, atol = 1e-10, events = {
    { when = y, call = function(so_far) seen[#seen + 1] = so_far:final(x) end },
    { when = x - 2 },
    { when = t - 10, action = "stop" },
  } }
  expect(sol.status):equals "event"
  expect(sol.t[sol.t.rows]):near(10, 0)
  expect(#sol.events):equals(4)
  for i = 1, 3 do
    expect(sol.events[i].t):near((i - 0.5) * math.pi, 1e-9)
    expect(seen[i]):near((-1)^(i + 1), 1e-9)
  end
  local halved = wave:integrate { start = { x = 0, y = 1 }, to = 5, rtol = 1e-10, atol = 1e-10,
    events = { { when = y, direction = -1, call = function(so_far)
      return { x = so_far:final(x) / 2 } end } } }
  expect(halved:final(x)):near(math.cos(5 - math.pi / 2) / 2, 1e-8)
  expect(function() wave:integrate { start = { x = 0, y = 1 }, to = 5,
    events = { { when = y, call = function() error "the bell broke" end } } } end)
    :fails "the bell broke"
end)

test("what ends an integration early is said with time and culprit", function()
  local blow_up = dae { der(x) ~ x^2 }
  for _, method in ipairs { "dopri5", "radau" } do
    local sol = blow_up:integrate { start = { x = 1 }, to = 2, method = method }
    expect(sol.status):matches "^stopped at t = [01]%.?%d*:.*x"
    expect(sol.t[sol.t.rows]):near(1, 1e-6)
    expect(sol:final(x) > 1e5):is_true()
  end
  local short = decay:integrate { start = { x = 1 }, to = 2, max_steps = 3 }
  expect(short.status):matches "max_steps = 3 steps were not enough"
  local half = dae { der(x) ~ -sqrt(1 - t) }:integrate { start = { x = 1 }, to = 2, method = "dopri5" }
  expect(half.status):matches "^stopped at t = 1:.*x′ is not finite"
end)

test("bad options are refused", function()
  local function refuse(options, words)
    options.start, options.to = options.start or { x = 1 }, options.to or 1
    expect(function() decay:integrate(options) end):fails(words)
  end
  refuse({ rtol = 0 }, "rtol = 0; a tolerance must be a positive number")
  refuse({ rtol = -1e-6 }, "rtol")
  refuse({ rtol = 1e-20 }, "below what double precision can reach")
  refuse({ atol = -1 }, "atol")
  refuse({ rtol = 1e-6, dt = 0.1 }, "give one of them")
  refuse({ method = "dorpi5" }, "Did you mean 'dopri5'?")
  refuse({ method = rk.rk4 }, "no embedded method")
  refuse({ method = "radau", dt = 0.1 }, "rk.radau(3)")
  refuse({ to = -1 }, "to = -1 must be greater than from = 0")
  refuse({ max_steps = 0 }, "max_steps")
  refuse({ dtmax = 0 }, "dtmax")
  refuse({ events = { { direction = 1 } } }, "needs when")
  refuse({ events = { { when = x, action = "halt" } } }, '"stop"')
  refuse({ events = { { when = x, direction = 3 } } }, "direction must be")
  refuse({ events = { { wen = x } } }, "Did you mean 'when'?")
  refuse({ events = { { when = x, reset = { y = 1 } } } }, "y")
end)

test("the chosen method is named with the reason, changes included", function()
  local function stats(model, to) return model:integrate { start = { x = 1 }, to = to }:stats() end
  local smooth = stats(decay, 2)
  expect(rk[smooth.method]:is "explicit"):is_true()
  expect(smooth.why):equals(smooth.method
    .. " from t = 0: explicit: not stiff at the start, order for this tolerance")
  expect(stats(dae { der(x) ~ -1e5*(x - cos(t)) }, 2).why):matches "^radau from t = 0: stiff: "
  local later = stats(dae { der(x) ~ -x*(1 + 1e4*t) + sin(t) }, 20)          -- becomes stiff on the way
  expect(later.method):matches "^%w+, then radau$"
  expect(later.why):matches "\nradau from t = 0%.%d+: stiff: stability, not accuracy"
  expect(tostring(later)):matches "Newton iterations +%d+\n%w+ from t = 0"
  expect(decay:integrate { start = { x = 1 }, to = 2, method = "radau" }:stats().why):equals ""
end)

test("what depends on time alone: functions of t, inputs and parameters at every stage", function()
  local z = var "z"
  local u, a = input "u", param "a"
  local model = dae { der(z) ~ -z*(a*cos(t)*u) }
  for _, value in ipairs { 1, -1/2 } do
    -- x = exp(-a ∫ s cos s ds)
    for _, method in ipairs { "bogacki_shampine", "dopri5", "dop853", "verner98" } do
      local sol = model:integrate { start = { z = 1 }, to = 5, inputs = { u = function(s) return s end },
        params = { a = value }, method = method, rtol = 1e-9, atol = 1e-12 }
      expect(sol:final(z)):near(math.exp(-value*(5*math.sin(5) + math.cos(5) - 1)), 1e-6)
    end
  end
end)
