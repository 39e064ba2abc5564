-- Missing samples, forecasts, several outputs together: the Kalman filter behind prediction errors.
local function record(N, gap, noise)
  seed(11)
  local e, q, p = randn(N), rand(N), prbs(1023)
  local u, y, holes = {}, {}, {}
  for t = 1, N do
    u[t] = p[(t - 1) % 1023 + 1]
    y[t] = 1.5 * (y[t-1] or 0) - 0.7 * (y[t-2] or 0) + (u[t-1] or 0) + 0.5 * (u[t-2] or 0)
      + noise * (e[t] + 0.4 * (t > 1 and e[t-1] or 0))
    holes[t] = q[t] < gap and 0/0 or y[t]
  end
  return iddata { y = y, u = u }, iddata { y = holes, u = u }
end

test("a model simulates inputs alone, from rest", function()
  local full = record(300, 0, 0)
  for _, m in ipairs { arx(full, { na = 2, nb = 2 }), oe(full, { nb = 2, nf = 2 }), n4sid(full, 2) } do
    expect(m:simulate { 1, 0, 0, 0 }):near({ 0, 1, 2, 2.3 }, 1e-9)  -- 1.5 + 0.5, 1.5*2 - 0.7
    expect(function() m:simulate({ 1, 0 }, { ic = "estimate" }) end):fails "iddata{ y = "
    expect(function() m:simulate { { 1, 0 }, { 0, 0 }, { 0, 0 } } end):fails
      "the model has 1 output and 1 input, the data 1 and 2"
  end
  local typed = idpoly { A = { 1, -1.5, 0.7 }, B = { 0, 1, 0.5 } }
  expect(typed:simulate(vec { 1, 0, 0, 0 })):near({ 0, 1, 2, 2.3 }, 1e-12)
  expect(function() typed:simulate({ 1, 0 }, { ic = "data" }) end):fails "from rest"
end)

local truth = { -1.5, 0.7, 1, 0.5, 0.4 }

test("a fifth of the samples missing does not bias", function()
  local _, d = record(1500, 0.2, 0.3)
  local m = armax(d, { na = 2, nb = 2, nc = 1 })
  for k = 1, 5 do expect(math.abs(m.theta[k] - truth[k]) < 4 * m.std[k]):is_true() end
  expect(m.sigma2):near(0.09, 0.01)
  expect(m:validate(d).white):is_true()
  local oe_model = oe(d, { nb = 2, nf = 2 })
  for k, v in ipairs { 1, 0.5, -1.5, 0.7 } do
    expect(math.abs(oe_model.theta[k] - v) < 6 * oe_model.std[k]):is_true()
  end
end)

test("without gaps both roads agree", function()
  local full = record(300, 0, 0.3)
  local m = armax(full, { na = 2, nb = 2, nc = 1 })
  local y = {}
  for t = 1, 300 do y[t] = t == 300 and 0/0 or full.y(t, 1) end      -- the last sample only
  local n = armax(iddata { y = y, u = full.u }, { na = 2, nb = 2, nc = 1 })
  local cut = armax(full:slice(1, 299), { na = 2, nb = 2, nc = 1 })
  expect(n.theta):near(cut.theta, 1e-6)
  expect(m:predict(full)):near(m:predict(full, { ic = "estimate" }), 1e-10)
end)

test("state space with gaps, and its refinement", function()
  local full, d = record(1000, 0.2, 0.3)
  local function poles(m)
    local p = m:poles()
    return { evaluate(p.re[1]), math.abs(evaluate(p.im[1])) }
  end
  local m = n4sid(d, { order = 2 })
  expect(poles(m)):near({ 0.75, math.sqrt(0.7 - 0.75^2) }, 0.02)
  local s = n4sid(full, { order = 2 })
  local r = pem(full, s)
  expect(r.loss <= s.loss):is_true()
  expect(r.loss):near(armax(full, { na = 2, nb = 2, nc = 2 }).loss, 1e-4)   -- one set of models
  expect(function() pem(full, arx(full, { na = 1, nb = 1 })) end):fails "refines state-space models"
end)

test("two outputs together", function()
  seed(4)
  local e, u = randn(600, 2), prbs(1023)
  local x1, x2, y1, y2, us = 0, 0, {}, {}, {}
  for t = 1, 600 do
    us[t] = u[t]
    y1[t], y2[t] = x1 + 0.2 * e(t, 1), x1 + x2 + 0.5 * e(t, 2)
    x1, x2 = 0.8 * x1 + 0.3 * x2 + u[t], -0.2 * x1 + 0.5 * x2 + 0.5 * u[t]
  end
  local d = iddata { y = { y1, y2 }, u = us }
  local m = pem(d, n4sid(d, { order = 2 }))
  local p = m:poles()
  expect(evaluate(p.re[1])):near(0.65, 0.03)
  expect(compare(d, m)[1].prediction.rows):equals(2)
end)

test("missing inputs are named", function()
  local u, y = {}, {}
  for t = 1, 60 do u[t], y[t] = (-1)^(t * t // 3), math.sin(t) end
  u[7] = 0/0
  local d = iddata { y = y, u = u }
  for _, call in ipairs { function() armax(d, { na = 1, nb = 1, nc = 1 }) end,
    function() n4sid(d, { order = 1 }) end } do
    expect(call):fails "u at sample 7; inputs must be known"
  end
end)

test("forecasts and their deviations", function()
  seed(9)
  local e, y = randn(400), { 0 }
  for t = 2, 400 do y[t] = 0.9 * y[t-1] + e[t] end
  local m = arx(iddata { y = y }, { na = 1 })
  local a = -m.theta[1]
  local values, std = m:forecasts(iddata { y = y }, 3)
  expect(values(3, 1)):near(a^3 * y[400], 1e-9)
  expect(std(3, 1)):near(math.sqrt(m.sigma2 * (1 + a^2 + a^4)), 1e-9)
  expect(m:rmse(iddata { y = y })):near(math.sqrt(m.loss), 1e-6)
end)
