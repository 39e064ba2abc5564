-- Prefilters and delays of data, and the validation of several outputs.

local function record(N, delays, noise)
  seed(18)
  local u, e, y = { randn(N), randn(N) }, { randn(N), randn(N) }, { {}, {} }
  for t = 1, N do
    for i = 1, 2 do
      y[i][t] = (0.3 + 0.3 * i) * (y[i][t - 1] or 0) + noise * e[i][t]
      for j = 1, 2 do
        local k = t - 1 - delays[j]
        if k >= 1 then y[i][t] = y[i][t] + (i + j) / 2 * u[j][k] end
      end
    end
  end
  return iddata { y = y, u = u, Ts = 0.5 }
end

test("a filter leaves a model without noise as it is", function()
  local d = record(200, { 0, 0 }, 0):select { y = 1 }
  local orders = { na = 1, nb = { 1, 1 }, ic = "zero" }
  local want = arx(d, orders).theta
  for _, f in ipairs { d:filter { w = { 0.5, 3 } }, d:filter { w = { 0, 2 }, order = 3 },
    d:filter { w = { 1, 1 / 0 }, order = 1 }, d:filter(tf({ 1, 0.2 }, { 1, -0.5, 0.1 }, 0.5)) } do
    local m = arx(f, orders)
    for k = 1, 3 do expect(m.theta[k]):near(want[k] + 0.0, 1e-9) end
  end
end)

test("Butterworth: 3 dB at the corners, whatever the band", function()
  local N, Ts = 4096, 0.01
  for _, band in ipairs { { 1, 20 }, { 0, 5 }, { 30, 1 / 0 } } do
    for _, w in ipairs { 1, 5, 20, 30 } do
      local x = {}
      for t = 1, N do x[t] = math.cos(w * Ts * t) end
      local y, sum = iddata { y = x, Ts = Ts }:filter { w = band, order = 2 }.y, { 0, 0 }
      local periods = math.floor(w * Ts * N / 2 / (2 * math.pi))
      local length = math.floor(periods * 2 * math.pi / (w * Ts) + 0.5)
      for t = N - length + 1, N do
        sum[1], sum[2] = sum[1] + y(t, 1) * math.cos(w * Ts * t), sum[2] + y(t, 1) * math.sin(w * Ts * t)
      end
      local gain = 2 * math.sqrt(sum[1]^2 + sum[2]^2) / length
      local low, high = math.tan(band[1] * Ts / 2), math.tan(math.min(band[2], 314.1592) * Ts / 2)
      local s = math.tan(w * Ts / 2)                    -- |H|² = 1/(1 + (s/sh)⁴) · 1/(1 + (sl/s)⁴)
      local want = 1 / math.sqrt((1 + (s / high)^4) * (1 + (low / s)^4))
      expect(gain):near(want, 0.02)                     -- of a record of a few periods
    end
  end
end)

test("inputs with delays of their own", function()
  local d = record(600, { 4, 1 }, 0.01)
  local e = d:delay { u = { 4, 1 } }
  expect(e.N):equals(596)
  expect(e.u(1, 1)):equals(d.u(1, 1))
  expect(e.u(1, 2)):equals(d.u(4, 2))
  expect(e.y(1, 1)):equals(d.y(5, 1))
  local m = n4sid(e, 2)                                 -- two states for two outputs, and none for the delays
  expect(m:fit(e)[1] > 98):is_true()
  expect(n4sid(d, 2):fit(d)[1] < 80):is_true()
  local two = merge(d:slice(1, 300), d:slice(301, 600)):delay { u = { 4, 1 } }
  expect(two.N):equals(592)
  expect(two.y(297, 1)):equals(d.y(305, 1))
end)

test("what cannot be filtered or delayed", function()
  local d = record(50, { 0, 0 }, 0.1)
  expect(function() d:filter { w = { 3, 1 } } end):fails "0 ≤ low < high"
  expect(function() d:filter { w = { 7, 9 } } end):fails "π/Ts = 6.28319 rad/s"
  expect(function() d:filter { w = 3 } end):fails "expected a list"
  expect(function() d:filter(tf({ 1 }, { 1, 1 })) end):fails [[c2d(F, 0.5, "tustin")]]
  expect(function() d:filter(tf({ 1 }, { 1, 0.1 }, 1)) end):fails "every 1 s, the data every 0.5 s"
  expect(function() iddata { y = { 1, 0/0, 2 } }:filter { w = { 0, 1 } } end):fails "d:fill():filter"
  expect(function() d:delay { u = { 1, 2, 3 } } end):fails "2, one for each input"
  expect(function() d:delay { u = -1 } end):fails "not negative"
  expect(function() d:delay { u = 50 } end):fails "leaves nothing"
end)

test("validation of several outputs is one value", function()
  local d = record(400, { 0, 0 }, 0.2)
  local v = arx(d, { na = { { 1, 0 }, { 0, 1 } }, nb = { { 1, 1 }, { 1, 1 } } }):validate(d)
  expect(#v):equals(2)
  expect(v.white):is_true()
  expect(v.independent):is_true()
  expect(v[2].fit):equals(v.y2.fit)
  expect(v[3]):equals(nil)
  expect(tostring(v):find("validation of y2", 1, true) ~= nil):is_true()
  expect(tostring(v:plot "cross"):find("2 panels", 1, true) ~= nil):is_true()
  expect(v:plot { output = "y2" }.title):equals "autocorrelation of the residuals"
  local poor = arx(d, { na = { { 0, 0 }, { 0, 1 } }, nb = { { 1, 1 }, { 1, 1 } } }):validate(d)
  expect(poor[2].white and not poor[1].white and not poor.white):is_true()
end)

test("a filter that is given takes no band beside it", function()
  expect(function() iddata { y = { 1, 2 } }:filter(tf({ 1 }, { 1, 0.5 }, 1), { w = { 0, 1 } }) end)
    :fails "takes the filter alone"
end)
