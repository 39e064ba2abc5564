-- Models in use: prediction, simulation, validation, scans, comparisons; and how they fail.
local r = (function(s) return function() s = (1103515245 * s + 12345) % 2147483648
  return s / 1073741824 - 1 end end)(99)
local u, w, y = {}, {}, {}
for t = 1, 300 do
  u[t] = r()
  w[t] = 1.5 * (w[t-1] or 0) - 0.7 * (w[t-2] or 0) + (u[t-1] or 0) + 0.5 * (u[t-2] or 0)
  y[t] = w[t] + 0.1 * r()
end
local d, clean = iddata { y = y, u = u }, iddata { y = w, u = u }

test("prediction and simulation by hand", function()
  local m = oe(clean, { nb = 2, nf = 2 })
  expect(m.theta):near({ 1, 0.5, -1.5, 0.7 }, 1e-11)
  expect(m.exact):is_true()
  expect(m:simulate(clean)):near(clean.y, 1e-10)
  expect(m:simulate(clean, { init = "zero" })):near(clean.y, 1e-10)
  expect(m:simulate(clean:slice(100, 200))):near(clean:slice(100, 200).y, 1e-10)
  local a = arx(d, { na = 2, nb = 2 })
  local p = a:predict(d)
  local th = a.theta
  for t = 3, 300 do
    expect(p[t]):near(-th[1] * y[t-1] - th[2] * y[t-2] + th[3] * u[t-1] + th[4] * u[t-2], 1e-12)
  end
  -- the k-step prediction tends to the simulation
  expect(a:predict(d, 200):slice(150, 300)):near(a:simulate(d):slice(150, 300), 1e-6)
  local two = a:predict(d, 2)
  for t = 5, 300 do                                        -- ŷ(t|t-2): the one-step formula with ŷ(t-1|t-2)
    local before = -th[1] * y[t-2] - th[2] * y[t-3] + th[3] * u[t-2] + th[4] * u[t-3]
    expect(two[t]):near(-th[1] * before - th[2] * y[t-2] + th[3] * u[t-1] + th[4] * u[t-2], 1e-11)
  end
end)

test("armax by hand", function()
  local m = armax(d, { na = 2, nb = 2, nc = 2 })
  local e, p = {}, m:predict(d, { init = "zero" })
  local a, b, c = m.A, m.B, m.C
  for t = 1, 300 do
    local function at(x, k) return t - k >= 1 and x[t-k] or 0 end
    local hat = -a[2] * at(y, 1) - a[3] * at(y, 2) + b[2] * at(u, 1) + b[3] * at(u, 2) + c[2] * at(e,
      1) + c[3] * at(e, 2)
    e[t] = y[t] - hat
    expect(p[t]):near(hat, 1e-11)
  end
end)

test("fits are labelled", function()
  local m = arx(d, { na = 2, nb = 2 })
  local fit, label = m:fit(d, "simulation")
  expect(label):equals "% fit, simulation, 298 samples"
  expect(fit > 80):is_true()
  expect(select(2, m:fit(d, 5))):equals "% fit, 5-step prediction, 298 samples"
  local o = oe(d, { nb = 2, nf = 2 })
  expect(o:fit(d)):near(o:fit(d, "simulation"), 1e-9)      -- an output-error model predicts what it simulates
  expect(o:fit(d)):near(o.fit_percent, 1e-6)
  expect(#o:residuals(d)):equals(300)
end)

test("validation tells a good model from a poor one", function()
  local good = bj(d, { nb = 2, nf = 2, nc = 0, nd = 1 }):validate(d)
  expect(good.white and good.independent):is_true()
  local poor = arx(d, { na = 1, nb = 1 }):validate(d)
  expect(poor.white):equals(false)
  expect(poor.independent):equals(false)
  expect(poor.ljung_box.p < 1e-6):is_true()
  expect(#good.autocorrelation):equals(25)
  expect(good.crosscorrelation.rows):equals(51)
  expect(tostring(poor):find("residuals are not white", 1, true) ~= nil):is_true()
end)

test("scans find the orders, comparisons the better model", function()
  local e, v = d:split(0.5)
  local s = order_scan(e, v, { na = { 1, 4 }, nb = { 1, 4 }, nk = { 1, 3 } })
  expect(#s):equals(48)
  expect(arx(e, s.best).rank > 0):is_true()
  expect(s[1].fit >= s[2].fit):is_true()
  local c = compare(v, { arx = arx(e, { na = 2, nb = 2 }), oe = oe(e, { nb = 2, nf = 2 }) })
  expect(c.oe.simulation > c.arx.simulation - 1):is_true()
  expect(function() order_scan(e, { criterion = "fit" }) end):fails "needs validation data"
  expect(function() order_scan(e, v, { na = { 3, 1 } }) end):fails "is not a range"
  expect(function() order_scan(e, v, { na = 1, nb = 1, nk = { 1, 400 } }) end):fails "too large"
end)

test("a scan in worker processes is the scan of one process", function()
  local ranges = { na = { 1, 6 }, nb = { 1, 8 }, nk = { 1, 8 }, workers = 1 }
  local one = order_scan(d, ranges)
  ranges.workers = 3
  local many = order_scan(d, ranges)
  expect(#many):equals(6*8*8)
  expect(tostring(many)):equals(tostring(one))
  for i = 1, #one do
    for key, value in pairs(one[i]) do expect(many[i][key] == value or value ~= value):is_true() end
  end
  expect(function() order_scan(d, { workers = 0 }) end):fails "workers = 0"
end)

test("bad input is refused with the reason", function()
  expect(function() oe(iddata { y = { 1, 2, 3, 4, 5, 6, 7, 8 }, u = { 1, 0/0, 3, 4, 5, 6, 7, 8 } },
    { nb = 1, nf = 1 }) end)
    :fails "d:fill()"
  expect(function() oe(d, { nf = 2 }) end):fails "nf without nb"
  expect(function() oe(d:slice(1, 5), { nb = 2, nf = 2 }) end):fails "too few"
  expect(function() armax(d, { na = 1, nb = 1, nc = 1,
    start = { 0 } }) end):fails "start: expected 3 numbers (a1, b1, c1)"
  expect(function() armax(d, { na = 1, nb = 1, nc = 1, start = { 0, 0, 2 } }) end):fails "stable"
  expect(function() arx(d, { na = 1, nb = 1 }):predict(iddata { y = { 1, 2 } }) end):fails "input"
  expect(function() arx(d, { na = 1, nb = 1 }):fit(d, "sim") end):fails "unknown mode"
  expect(function() arx(d, { na = 1, nb = 1 }):simulate(d, { init = "none" }) end):fails "unknown ic"
  -- constant output, constant input: no NaN, a rank report
  local flat = {}
  for t = 1, 50 do flat[t] = 1 end
  local m = arx(iddata { y = flat, u = flat }, { na = 1, nb = 1 })
  expect(m.rank):equals(1)
  expect(tostring(m):find("nan", 1, true)):equals(nil)
  local zero = {}
  for t = 1, 50 do zero[t] = 0 end
  expect(arx(iddata { y = zero, u = zero }, { na = 1, nb = 1 }).rank):equals(0)
  expect(tostring(oe(iddata { y = zero, u = flat }, { nb = 1, nf = 1 })):find("nan", 1, true)):equals(nil)
  expect(tostring(arx(iddata { y = zero, u = zero }, { na = 1, nb = 1 })):find("nan", 1, true)):equals(nil)
end)

test("a time series", function()
  local x = {}
  local e = {}
  for t = 1, 2000 do
    e[t] = r() + r() + r()
    x[t] = 0.8 * (x[t-1] or 0) + e[t] + 0.5 * (e[t-1] or 0)
  end
  local m = armax(iddata { y = x }, { na = 1, nc = 1 })
  expect(m.kind):equals "ARMA"
  expect(m.theta):near({ -0.8, 0.5 }, 0.1)                 -- std below 0.025
  expect(m:validate(iddata { y = x }).white):is_true()
end)

test("a scan of several outputs is what arx estimates", function()
  local v = {}
  for t = 1, 300 do v[t] = { y[t], w[t] + 0.05 * r() } end
  local both = iddata { y = v, u = u }
  local s = order_scan(both, { na = { 1, 2 }, nb = { 1, 2 }, nk = 1, criterion = "bic" })
  expect(#s):equals(4)
  for i = 1, 4 do
    expect(s[i].parameters):equals(2 * (2 * s[i].na + s[i].nb))
    -- det(EᵀE/N): the scan uses the rows of its largest model, and so does arx with as many samples left out
    if s[i].na == 2 and s[i].nb == 2 then
      local m = arx(both, { na = 2, nb = 2, nk = 1 })
      local e = m:residuals(both)
      expect(s[i].loss):near(det(e.T * e * (1 / e.rows)), 1e-12)
      expect(s[i].aic):near(e.rows * math.log(s[i].loss) + 2 * s[i].parameters, 1e-8)
    end
  end
  expect(s[1].na):equals(2)
  expect(order_scan(both:slice(1, 150), both:slice(151, 300),
    { na = { 1, 2 }, nb = 1, nk = 1 })[1].fit > 50):is_true()
end)

test("a start in words is ic", function()
  for _, ic in ipairs { "drop", "zero", "estimate" } do
    expect(arx(d, { na = 2, nb = 2, start = ic }).theta):equals(arx(d, { na = 2, nb = 2, ic = ic }).theta)
    expect(oe(d, { nb = 2, nf = 2, start = ic }).theta):equals(oe(d, { nb = 2, nf = 2, ic = ic }).theta)
  end
  expect(function() arx(d, { na = 2, nb = 2, start = "dorp" }) end):fails "Did you mean 'drop'"
end)

test("models are linear systems, and say how they were made", function()
  local m = arx(d, { na = 2, nb = 2 })
  expect(#m:poles()):equals(2)
  expect(m:dcgain()):near((m.theta[3] + m.theta[4]) / (1 + m.theta[1] + m.theta[2]), 1e-12)
  expect(m:tf()(1)):near(m:ss():dcgain(), 1e-10)
  expect(m.orders.na * 100 + m.orders.nb * 10 + m.orders.nk):equals(221)
  expect(arx(d, m.orders).theta):equals(m.theta)
  expect(m.covariance):equals(m.cov)
  expect(arx(iddata { y = { 1, 2, 4.5, 9, 18 } }, { na = 1 }):latex():find("A(q) &= 1 - 2.", 1,
    true) ~= nil):is_true()
  expect(bj(d, { nb = 1, nf = 1, nc = 1, nd = 1 }):latex():find("\\frac{B(q)}{F(q)}", 1,
    true) ~= nil):is_true()
  expect(m.samples):equals(300)
  expect(m:predictor().linear):is_true()
  local c = compare(d, { arx = m, oe = oe(d, { nb = 2, nf = 2 }) })
  expect(tostring(c:plot()):find "3 series" ~= nil):is_true()
  expect(tostring(order_scan(d, { na = { 1, 3 }, nb = { 1, 3 },
    nk = 1 }):plot()):find "2 series" ~= nil):is_true()
end)

test("exact data: the smallest model wins a scan, and nothing is said about noise that is not there",
  function()
  local s = order_scan(clean, { na = { 1, 4 }, nb = { 1, 4 }, nk = { 1, 2 } })
  expect(s.best.na * 100 + s.best.nb * 10 + s.best.nk):equals(221)
  expect(s[1].loss):equals(0)
  expect(tostring(s):find("exact", 1, true) ~= nil):is_true()
  local m = armax(clean, { na = 2, nb = 2, nc = 2 })
  expect(m.exact):is_true()
  expect(m.theta):near({ -1.5, 0.7, 1, 0.5, 0, 0 }, 1e-11)
  expect(m.unidentifiable[1]):equals "c1 is not identifiable"
  expect(m.advice[1]):equals "there is no noise in the data from which C and D could be found"
end)
