-- Several outputs: a panel for each, or the one that is asked for.
seed(2)
local function record(N)
  local u, y = { {}, {} }, { {}, {} }
  local e, r = randn(N, 2), randn(N, 2)
  for t = 1, N do
    for i = 1, 2 do u[i][t] = r(t, i) + 0.0 end
    y[1][t] = 0.7 * (y[1][t-1] or 0) + (u[1][t-1] or 0) + 0.3 * (u[2][t-1] or 0) + 0.1 * e(t, 1)
    y[2][t] = 0.5 * (y[2][t-1] or 0) - 40 * (u[1][t-1] or 0) + 100 * (u[2][t-1] or 0) + 5 * e(t, 2)
  end
  return iddata { y = y, u = u, Ts = 0.1, yname = { "speed", "temp" }, uname = { "volt", "valve" } }
end
local d = record(200)
local s, a = n4sid(d, { order = 2 }), arx(d, { na = {{1, 0}, {0, 1}}, nb = 1 })

local function panels(f) return tonumber(tostring(f):match "(%d+) panels") or 1 end

test("data: a panel for each signal", function()
  expect(panels(d:plot())):equals(4)
  expect(panels(d:select { y = 1, u = 1 }:plot())):equals(2)
  expect(panels(iddata { y = { 1, 2, 3 } }:plot())):equals(1)
end)

test("models, comparisons, forecasts: a panel for each output", function()
  for _, m in ipairs { s, a } do
    expect(panels(m:plot(d))):equals(2)
    expect(panels(m:plot(d, { output = "temp" }))):equals(1)
    expect(m:plot(d, { output = 2 }).title):equals(m:plot(d, { output = "temp" }).title)
    expect(m:plot(d, { title = "mine" }).title):equals "mine"
    expect(function() m:plot(d, { output = "pressure" }) end)
      :fails "there is no output \"pressure\"; there are speed, temp"
    expect(function() m:plot(d, { output = 3 }) end):fails "there is no output 3"
    expect(function() m:plot(d, { colur = "red" }) end):fails "colur"
  end
  expect(panels(compare(d, { s = s, a = a }):plot())):equals(2)
  expect(panels(compare(d, { s = s, a = a }):plot { output = 1 })):equals(1)
  local f = s:forecast(d, 3, { u = { { 1, 1, 1 }, { 0, 0, 0 } } })
  expect(panels(f:plot())):equals(2)
  expect(tostring(f):find "forecast of speed.*forecast of temp" ~= nil):is_true()
end)

test("a fit of two outputs", function()
  local x, y, k = var "x", var "y", param("k", 1)
  local sys = dae { der(x) ~ -k*x, der(y) ~ x }
  local data = iddata { y = { { 2, 1.2, 0.7, 0.45 }, { 0, 1.6, 2.5, 3.1 } }, Ts = 1 }
  local r = fit(sys, { params = { k }, data = data, y = { x, y }, start = { x = 2, y = 0 } })
  expect(panels(r:plot())):equals(2)
  expect(panels(r:plot { output = 2 })):equals(1)
end)

test("the fit in a picture is that of the data in it", function()
  local function response(N, K)
    local u, y = {}, { 0 }
    for t = 1, N do
      u[t] = (t * t // 9) % 2 == 0 and 1 or -1
      y[t] = t == 1 and 0 or y[t-1] + 0.2 * (K * u[t-1] - y[t-1])
    end
    return iddata { y = y, u = u, Ts = 1 }
  end
  local m = tfest(response(120, 2), { np = 1, ic = "zero" })
  expect(m:plot(response(120, 2)).title):equals "simulation, fit 100 %"
  local half = tonumber(m:plot(response(90, 4)).title:match "fit ([%d.]+) %%")
  expect(half):near(50, 0.02)
end)
