-- Findings on identification that have no place among the tests of their subject.

local function said(value, text) expect(tostring(value):find(text, 1, true) ~= nil):is_true() end
local function unsaid(value, text) expect(tostring(value):find(text, 1, true) == nil):is_true() end

-- y = 0.8 y(t-1) + u(t-1) + 0.5 e with an input, or a law and a disturbance of it; with another noise model.
local function record(N, law, coloured)
  seed(4)
  local u, y, e = {}, {}, randn(N)
  for t = 1, N do
    u[t] = law(t, y[t - 1] or 0)
    local noise = e[t] + (coloured and t > 1 and 0.7*e[t - 1] or 0)
    y[t] = 0.8*(y[t - 1] or 0) + (u[t - 1] or 0) + 0.5*noise
  end
  return iddata { y = y, u = u }
end
local function pulses(t) return 0.3*(-1)^(t*t//7) end

test("estimators that feedback makes wrong say so", function()
  local d = record(1000, function(t, last) return -0.5*last + pulses(t) end)
  for _, r in ipairs { oe(d, { nb = 1, nf = 1 }), n4sid(d, { order = 1 }), iv4(d, { na = 1, nb = 1 }), spa(d),
    etfe(d), cra(d), tfest(d, { np = 1 }), process_model(d, "P1") } do
    said(r, "may have been taken in closed loop (u: ")
  end
  said(oe(d, { nb = 1, nf = 1 }), "B and F may then be biased")
  said(spa(d), "between the plant and -1/controller")
  for _, r in ipairs { arx(d, { na = 1, nb = 1 }), armax(d, { na = 1, nb = 1, nc = 1 }),
    bj(d, { nb = 1, nf = 1, nc = 1, nd = 1 }), pem(d, n4sid(d, { order = 1 })) } do
    unsaid(r, "closed loop")
  end
  expect(d:feedback():match "^u: χ² = %d+ on 25 degrees of freedom$" ~= nil):is_true()
end)

test("open loops are not taken for closed ones", function()
  local inputs = { prbs(1000), multisine(1000), chirp(1000, { from = 0.01, to = 0.4 }) }
  for _, u in ipairs(inputs) do
    local list = {}
    for t = 1, 1000 do list[t] = evaluate(u[t]) + 0.0 end
    for _, coloured in ipairs { false, true } do
      local d = record(1000, function(t) return list[t] end, coloured)
      expect(d:feedback()):is_nil()
      unsaid(oe(d, { nb = 1, nf = 1 }), "closed loop")
      unsaid(arx(d, { na = 2, nb = 2 }):validate(d), "closed loop")
      unsaid(spa(d), "closed loop")
    end
  end
  local hair = iddata.read("scripts/data/hairdryer.csv", { y = "y_temp", u = "u_voltage", Ts = 0.08 })
  expect(hair:feedback()):is_nil()
  expect(record(50, pulses):feedback()):is_nil()
  expect(iddata { y = { 1, 2, 0/0, 3 }, u = { 1, 2, 3, 4 } }:feedback()):is_nil()
  expect(iddata { y = { 1, 2, 3, 3 } }:feedback()):is_nil()
  expect(function() hair:feedback(2) end):fails "there is no output 2"
end)

test("nlsq prints what it found", function()
  local function residuals(p) return { p[1] - 1, p[1]*p[2] - 6, p[2] - 5.9 } end
  local r = nlsq(residuals, { 1, 1 }, { upper = { 9, 5 } })
  said(r, "least squares of 2 parameters, 3 residuals: SSE = 0.848462")
  said(r, "θ[2] = 5  (on a bound)")
  said(r, "search: a minimum")
  local free = nlsq(function(p) return { p[1] + p[2] - 1, p[1] + p[2] - 1.1 } end, { 1, 1 })
  said(free, "the residuals determine only 1 of 2 parameters")
end)

local x, k = var "x", param("k", 1)
local decay = dae { der(x) ~ -k*x }
local function fitted(noise, rtol)
  local y = {}
  for i = 0, 10 do y[i + 1] = math.exp(-0.3*i) + noise*(-1)^(i*i//3) end
  return fit(decay, { params = { k }, data = iddata { y = y, Ts = 1 }, y = x, start = { x = 1 },
    rtol = rtol })
end

test("exact data have no interval: profile and bootstrap say so", function()
  for _, rtol in ipairs { 1e-6, 1e-8, 1e-10 } do
    local r = fitted(0, rtol)
    expect(r.exact):is_true()
    expect(function() r:profile(k) end):fails "the data are exact"
    expect(function() r:bootstrap() end):fails "the data are exact"
  end
  local noisy = fitted(1e-3)
  expect(noisy.exact):equals(false)
  local p = noisy:profile(k)
  expect(p.low < 0.3 and 0.3 < p.high):is_true()
end)

test("constant inputs: no word of a minimum norm", function()
  local u, y = {}, {}
  for t = 1, 60 do u[t], y[t] = 1, 1 - 0.5^(t - 1) + 0.01*math.sin(t*t) end
  local m = oe(iddata { y = y, u = u }, { nb = 2, nf = 1 })
  unsaid(m, "minimum norm")
  said(m, "only b1 + b2 is determined")
end)

test("the fit of rows is that of the samples that are compared", function()
  local d = iddata.read("scripts/data/hairdryer.csv", { y = "y_temp", u = "u_voltage", Ts = 0.08 })
  d = d:slice(1, 40)
  local m = arx(d, { na = 2, nb = 2, nk = 3, ic = "drop" })
  local sum, mean = 0, 0
  for t = 5, 40 do mean = mean + d.y[t]/36 end
  for t = 5, 40 do sum = sum + (d.y[t] - mean)^2 end
  expect(m.fit_percent):near(100*(1 - math.sqrt(m.loss*36/sum)), 1e-9)
end)

test("the delay is that of the plant, not one of the models that contain it", function()
  for delay = 1, 4 do
    for seeds = 1, 5 do
      seed(seeds)
      local u, y, e, r = {}, {}, randn(400), randn(400)
      for t = 1, 400 do
        u[t] = r[t]
        y[t] = 0.7*(y[t - 1] or 0) + (t > delay and r[t - delay] or 0) + 0.1*e[t]
      end
      local nk, details = delay_estimate(iddata { y = y, u = u })
      expect(nk):equals(delay)
      said(details, ("delay of %d sample"):format(delay))
    end
  end
end)

test("options that mean nothing are refused", function()
  local d = record(300, pulses)
  local plain = impulse_estimate(d, { lags = 5 })
  expect(impulse_estimate(d, { lags = 5, kernel = "none" }).g[2]):equals(plain.g[2])
  said(impulse_estimate(d, { lags = 5, kernel = "TC" }), "regularised FIR (TC)")
  for _, order in ipairs { -1, 1000 } do
    expect(function() cra(d, { whiten = order }) end):fails "a whole number from 0 to 30"
    expect(function() impulse_estimate(d, { whiten = order }) end):fails "a whole number from 0 to 30"
  end
  expect(function() rarx(d, { na = 1, nb = 1, P0 = -1 }) end):fails "P0 is a variance > 0"
  expect(function() process_model(d, "P1D", { max_delay = -1 }) end):fails "max_delay is a number of seconds"
  local m = arx(d, { na = 1, nb = 1 })
  expect(function() m:forecasts(d, -3, { u = {} }) end):fails "steps must be at least 1"
end)

test("a model and data of another sampling time do not meet", function()
  local d = record(300, pulses)
  local y, u = {}, {}
  for t = 1, 300 do y[t], u[t] = d.y[t], d.u[t] end
  local other = iddata { y = y, u = u, Ts = 0.2 }
  for _, m in ipairs { arx(d, { na = 1, nb = 1 }), oe(d, { nb = 1, nf = 1 }), n4sid(d, 1) } do
    for _, use in ipairs { "fit", "predict", "simulate", "residuals", "validate" } do
      expect(function() m[use](m, other) end):fails "samples 1 s apart, the data are 0.2 s apart: d:resample(1)"
    end
    expect(function() compare(other, m) end):fails "0.2 s apart"
  end
end)

-- y = B/A u + noise of its own of order 1, the input as wanted: chance may say so in 1 of 1000 records.
test("feedback: false alarms are rare for inputs of every kind", function()
  local kinds = { white = function(r) return r end, slow = function(r, last) return 0.9*last + r end,
    held = function(r, last, t) return t % 10 == 1 and (r > 0 and 1 or -1) or last end }
  for _, kind in pairs(kinds) do
    seed(1)
    local alarms = 0
    for _ = 1, 100 do
      local r, e, u, y, v, w = randn(300), randn(300), {}, {}, 0, {}
      for t = 1, 300 do
        u[t] = kind(r[t], u[t - 1] or 0, t)
        w[t] = 0.8*(w[t - 1] or 0) + (u[t - 1] or 0) + 0.3*(u[t - 5] or 0)
        v = 0.9*v + e[t]
        y[t] = w[t] + 0.5*v
      end
      if iddata { y = y, u = u }:feedback() then alarms = alarms + 1 end
    end
    expect(alarms <= 2):is_true()                                  -- more: 1.5e-4 by chance
  end
end)
