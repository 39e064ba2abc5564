-- Estimates beyond polynomial models, against what generated the data.
local function data(N, noise)
  seed(5)
  local u, e, y, before = prbs(1023), randn(N), {}, 0
  local us = {}
  for t = 1, N do
    us[t] = u[(t - 1) % 1023 + 1]
    y[t] = 1.2 * (y[t-1] or 0) - 0.5 * (y[t-2] or 0) + (us[t-3] or 0) + noise * (e[t] + 0.8 * before)
    before = e[t]
  end
  return iddata { y = y, u = us, Ts = 0.5 }
end

local d = data(1023, 0.3)

local function gain(w)
  local z = { math.cos(0.5 * w), math.sin(0.5 * w) }
  local re, im = 1 - 1.2 * z[1] + 0.5 * math.cos(w), 1.2 * z[2] - 0.5 * math.sin(w)
  return 1 / math.sqrt(re^2 + im^2)
end

test("frequency responses: etfe, coherence, Welch", function()
  local r = etfe(d, { smooth = 20 })
  for _, k in ipairs { 50, 150, 300 } do expect(math.abs(r.mag[k] / gain(r.w[k]) - 1) < 0.2):is_true() end
  local c = coherence(d)
  expect(c.value[10] > c.bound):is_true()
  local e = randn(4000)
  local p = welch(e)
  local sum = 0
  for k = 1, #p.f do sum = sum + p.power[k] * (p.f[2] - p.f[1]) end
  expect(sum):near(1, 0.06)                                          -- the variance
  local noise = coherence(iddata { y = randn(1000), u = randn(1000) })
  local above = 0
  for k = 1, #noise.f do if noise.value[k] > noise.bound then above = above + 1 end end
  expect(above <= 6):is_true()
end)

test("impulse responses and the delay", function()
  local exact = { 0, 0, 0, 1 }
  for k = 5, 21 do exact[k] = 1.2 * exact[k-1] - 0.5 * exact[k-2] end
  for _, r in ipairs { impulse_estimate(d, { lags = 20 }),
    impulse_estimate(d, { lags = 20, kernel = "TC" }) } do
    for k = 1, 21 do expect(math.abs(r.g[k] - exact[k]) < 5 * r.std[k] + 0.02):is_true() end
  end
  local c = cra(d, { lags = 10 })
  expect(math.abs(c.g[3]) < c.bound[3]):is_true()                    -- lag 0 and before: nothing
  expect(delay_estimate(d)):equals(3)
end)

test("instruments are right where least squares is biased", function()
  local iv, ls = iv4(d, { na = 2, nb = 1, nk = 3 }), arx(d, { na = 2, nb = 1, nk = 3 })
  for k, v in ipairs { -1.2, 0.5, 1 } do expect(math.abs(iv.theta[k] - v) < 4 * iv.std[k]):is_true() end
  expect(math.abs(ls.theta[1] + 1.2) > 4 * ls.std[1]):is_true()
end)

test("recursive estimates end where the others are, and follow changes", function()
  local r, m = rarx(d, { na = 2, nb = 1, nk = 3 }), arx(d, { na = 2, nb = 1, nk = 3, ic = "zero" })
  for k = 1, 3 do expect(r.theta[1023][k]):near(m.theta[k], 1e-4) end
  local x = rarmax(d, { na = 2, nb = 1, nk = 3, nc = 1 })
  for k, v in ipairs { -1.2, 0.5, 1, 0.8 } do expect(x.theta[1023][k]):near(v, 0.06) end
  local u, y = prbs(1023), {}
  for t = 1, 1000 do y[t] = (t < 500 and 1 or 2) * (t > 1 and u[t-1] or 0) end
  for _, options in ipairs { { nb = 1, forgetting = 0.9 }, { nb = 1, drift = 0.01 } } do
    local us = {}
    for t = 1, 1000 do us[t] = u[t] end
    local f = rarx(iddata { y = y, u = us }, options)
    expect(f.theta[450][1]):near(1, 1e-3)
    expect(f.theta[1000][1]):near(2, 1e-3)
  end
end)

test("continuous time: process models and transfer functions", function()
  local u = {}
  for t = 1, 300 do u[t] = (t // 17) % 2 + 0.3 * ((t // 5) % 2) end
  local n = randn(300)
  local function noisy(y) for t = 1, 300 do y[t] = y[t] + 0.02 * n[t] end return y end
  local function list(c) local out = {} for k = 1, c.rows do out[k] = c[k] end return out end
  for _, scale in ipairs { 1e-6, 1, 1e3 } do                         -- units of time
    local y = noisy(list(held_response({3}, {8 * scale, 1}, 2.3 * scale, u, scale)))
    local r = process_model(iddata { y = y, u = u, Ts = scale }, "P1D")
    for k, v in ipairs { 3, 8 * scale, 2.3 * scale } do
      expect(math.abs(r.theta[k] - v) < 5 * r.std[k]):is_true()
      expect(r.std[k] < 0.05 * v):is_true()
    end
  end
  local y = noisy(list(held_response({3, 1}, {1, 0.5, 1}, 0, u, 0.3)))
  local r = tfest(iddata { y = y, u = u, Ts = 0.3 }, { np = 2 })
  for k, v in ipairs { 3, 1, 0.5, 1 } do expect(math.abs(r.theta[k] - v) < 5 * r.std[k]):is_true() end
  expect(function() process_model(d, "Q1") end):fails "is not a type"
end)

test("Hammerstein–Wiener with given bases", function()
  local u, n, w, y = randn(400), randn(400), {}, {}
  local us = {}
  for t = 1, 400 do
    us[t] = u[t]
    local v = t > 1 and u[t-1] + 0.4 * u[t-1]^2 or 0
    w[t] = 0.7 * (w[t-1] or 0) + v
    y[t] = w[t] + 0.02 * w[t]^3 + 0.02 * n[t]
  end
  local r = hammerstein(iddata { y = y, u = us }, { nb = 1, nf = 1,
    input = { function(x) return x end, function(x) return x^2 end },
    output = { function(x) return x end, function(x) return x^3 end } })
  expect(r.c[2]):near(0.4, 0.01)
  expect(r.d[2]):near(0.02, 0.001)
  expect(r.f[1]):near(-0.7, 0.01)
  expect(r:simulate(iddata { y = y, u = us }).rows):equals(400)
end)

test("what a covariance means for poles, responses and curves", function()
  local m = oe(d, { nb = 1, nf = 2, nk = 3 })
  local u = uncertain(m)
  local p = u:poles()
  local b = u:bode { 0.5, 2 }
  expect(math.abs(b.mag[1] - gain(0.5)) < 4 * b.mag_std[1] + 0.02):is_true()
  expect(#p.re):equals(3)
  -- G(1) = b/(1 + f1 + f2): the deviation of the last value of a step by hand
  local th, C = m.theta, m.cov
  local D = 1 + th[2] + th[3]
  local g = { 1 / D, -th[1] / D^2, -th[1] / D^2 }
  local var = 0
  for i = 1, 3 do for j = 1, 3 do var = var + g[i] * g[j] * C(i, j) end end
  local s = u:step(60)
  expect(s.std[#s.std]):near(math.sqrt(var), 1e-4)
  expect(tostring(u:nyquist():plot()):find "Nyquist" ~= nil):is_true()
end)

test("regularised FIR is nearer than least squares, in every unit", function()
  local exact = { 0, 0, 1 }
  for k = 4, 70 do exact[k] = 1.2 * exact[k-1] - 0.5 * exact[k-2] end
  local function off(m, unit)
    local sum = 0
    for k = 1, 70 do sum = sum + (m.theta[k] / unit - exact[k])^2 end
    return sum
  end
  local short = d:slice(1, 200)
  local plain = off(fir(short, { nb = 70 }), 1)
  for _, kernel in ipairs { "TC", "DC" } do
    expect(off(fir(short, { nb = 70, kernel = kernel }), 1) < 0.5 * plain):is_true()
    local y = {}
    for t = 1, 200 do y[t] = 1e7 * short.y(t, 1) end
    local scaled = fir(iddata { y = y, u = short.u }, { nb = 70, kernel = kernel })
    expect(scaled.theta[5] / 1e7):near(fir(short, { nb = 70, kernel = kernel }).theta[5], 1e-3)
  end
  expect(function() fir(d, { nb = 5, kernel = "XX" }) end):fails "unknown kernel"
end)

-- What is drawn: every estimate has a picture, bands where deviations are known.
test("pictures of estimates", function()
  local m = armax(d, { na = 2, nb = 1, nc = 1, nk = 3 })
  local u = uncertain(m)
  expect(tostring(coherence(d):plot())):equals "figure 'Coherence': 2 series, 130 points"
  for _, r in ipairs { spa(d), etfe(d), cra(d), impulse_estimate(d), welch(d.y.T), u:bode(), u:step(),
    u:nyquist(), rarx(d, { na = 1, nb = 1 }), m:forecast(d, 3, { u = { 1, 1, 1 } }), m:validate(d) } do
    expect(tostring(r:plot()):find "^figure" ~= nil):is_true()
  end
end)

test("the regions of conjugate poles are mirror images, also where they are nearly real", function()
  local b, a, e, us, ys = { 1, 0.5 }, { -1.3, 0.4227 }, randn(400), {}, {}
  local w, p = {}, randn(400)
  for t = 1, 400 do
    us[t] = p[t]
    w[t] = b[1] * (us[t-1] or 0) + b[2] * (us[t-2] or 0) - a[1] * (w[t-1] or 0) - a[2] * (w[t-2] or 0)
    ys[t] = w[t] + 0.5 * e[t]
  end
  local r = uncertain(oe(iddata { y = ys, u = us }, { nb = 2, nf = 2 })):poles()
  if r.im[1] ~= 0 then
    expect(r.std_re[1]):near(r.std_re[2], 1e-6)
    expect(r.covariances[1][2]):near(-r.covariances[2][2], 1e-6 * r.covariances[1][3])
  end
end)

-- Found by the fuzzer: the delay in samples was no integer of the machine, or a negative one read behind the
-- input.
test("delays longer than a record, and negative ones", function()
  local ones = { 1, 1, 1 }
  for _, delay in ipairs { 3, 3.5, 1e300, math.maxinteger, 1/0 } do
    expect(held_response({ 1 }, { 1, 1 }, delay, ones, 1)):equals(vec { 0, 0, 0 })
  end
  expect(held_response({ 1 }, { 1, 1 }, 0.5, ones, 5e-324)):equals(vec { 0, 0, 0 })
  local d = iddata { y = { 0, 0.5, 1 }, u = ones }
  expect(continuous_errors({ 1 }, { 1, 0 }, 1/0, d)):equals(continuous_errors({ 1 }, { 1, 0 }, 3, d))
  expect(function() continuous_errors({ 1 }, { 1, 0 }, -2, d) end):fails "the delay must not be negative"
end)
