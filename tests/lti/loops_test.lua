-- Feedback and observers around models, the extended Kalman filter.
local th, z = vars "theta z"
local u = input "u"
local pendulum = dae { der(th, 2) ~ sin(th) - 0.1 * der(th) + z, 0 ~ z - 2 * u }
local rest = pendulum:init { fix = { theta = 0, [th.dot] = 0 }, inputs = { [u] = 0 } }
local G = pendulum:linearize(rest, { outputs = { th } })
local K = place(G, { -1, -2 })

test("a law for an input gives a model again", function()
  local loop = pendulum:close { u = -K * vec { th, th.dot } }
  expect(#loop.inputs):equals(0)
  local at = loop:init { fix = { theta = 0, [th.dot] = 0 } }
  expect(loop:linearize(at):poles()):near({ -2, -1 }, 1e-9)
  expect(math.abs(loop:integrate { start = { theta = 0.5, [th.dot] = 0 }, to = 20 }(th, 20)) < 1e-4):is_true()
  local by_symbol = pendulum:close { [u] = -K * vec { th, th.dot } }
  expect(#by_symbol.inputs):equals(0)
  expect(function() pendulum:close { w = 1 } end):fails "no input 'w'"
  expect(function() pendulum:close {} end):fails "give a law"
end)

test("separation: the poles of regulator and observer together", function()
  local L = place(G.A.T, G.C.T, { -4, -5 }).T
  local est = estimator(pendulum, L, { y = th })
  local loop = pendulum:close { u = -K * est.x, est }
  local at = loop:init { fix = { theta = 0, [th.dot] = 0, [est.x[1]] = 0, [est.x[2]] = 0 } }
  expect(loop:linearize(at):poles()):near({ -5, -4, -2, -1 }, 1e-6)
  local run = loop:integrate { start = { theta = 0.3, [th.dot] = 0, [est.x[1]] = 0, [est.x[2]] = 0 },
    to = 15 }
  expect(math.abs(run(th, 15)) < 1e-3):is_true()
  local linear = estimator(G, L)
  expect(linear:poles()):near({ -5, -4 }, 1e-9)
  expect(function() estimator(pendulum, vec { 1, 2, 3 }, { y = th }) end):fails "L must be 2×1"
end)

test("the extended filter is the Kalman filter of a linear model", function()
  local x, v, w = vars "x v w"
  local f = input "f"
  local mass = dae { der(x) ~ v, der(v) ~ w - x, 0 ~ w - f }
  seed(2)
  local ys, us, noise = {}, {}, randn(40)
  for k = 1, 40 do us[k], ys[k] = math.sin(k), math.cos(0.1 * k) + 0.1 * noise[k] end
  ys[7] = 0/0
  local r = ekf(mass, { data = iddata { y = ys, u = us, Ts = 0.1 }, y = x, Q = { 1e-4, 1e-3 }, R = 0.01,
    start = { x = 1, v = 0 }, P0 = 0.1, rtol = 1e-10 })
  local D = c2d(ss({ { 0, 1 }, { -1, 0 } }, { 0, 1 }, { 1, 0 }), 0.1)
  local k = kalman_filter(D, mat { { "0.0001", 0 }, { 0, "0.001" } }, 0.01,
    { y = ys, u = us, x0 = { 1, 0 }, P0 = 0.1 })
  for t = 1, 40 do
    expect(r.x[t][1]):near(k.x(t, 1), 1e-6)
    expect(r.std[t][2]):near(k.std(t, 2), 1e-6)
  end
  expect(r.log_likelihood):near(k.log_likelihood, 1e-5)
end)

test("a smoother knows more than a filter", function()
  local D = ss({ { 1 } }, { 1 }, { 1 }, { 0 }, 1)
  local options = { u = zeros(5, 1), y = { 1, 3, 2, 0/0, 4 }, P0 = 1e6 }
  local filter = kalman_filter(D, 0.5, 1, options)
  options.smooth = true
  local smooth = kalman_filter(D, 0.5, 1, options)
  for t = 1, 4 do expect(smooth.std(t, 1) < filter.std(t, 1)):is_true() end
  expect(smooth.x(5, 1)):near(filter.x(5, 1), 1e-12)
end)
