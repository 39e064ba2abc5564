-- What the library says of data and models that are not as they should be.
local function file(name, text)
  local path = os.tmpname() .. name
  local f = io.open(path, "w")
  f:write(text)
  f:close()
  return path
end

local function table_of(rows, row)
  local lines = {}
  for k = 0, rows - 1 do lines[#lines + 1] = row(k) end
  return table.concat(lines, "\n") .. "\n"
end

local function said(value, text) expect(tostring(value):find(text, 1, true) ~= nil):is_true() end

test("a gap in the times is named where it is", function()
  local path = file(".csv", "t,u,y\n" .. table_of(41, function(k)
    return ("%g,%g,%g"):format((k < 30 and k or k + 2) * 0.5, math.sin(k * k), math.cos(k))
  end))
  expect(function() iddata.read(path) end):fails "from sample 30 to 31 they step by 1.5, mostly by 0.5"
  said(iddata.read(path, { Ts = 0.5 }), "Ts = 0.5,")
end)

test("trailing separators are no columns, and Ts that is not in the file is said", function()
  for _, tail in ipairs { "\t\t", "\t\t\t" } do
    local path = file(".dat", table_of(41, function(k)
      return ("%g\t%g%s"):format(math.sin(k * k), k, tail)
    end))
    expect(function() iddata.read(path) end):fails "(columns: column1, column2)"
    said(iddata.read(path, { u = 1, y = 2 }), "Ts = 1 (assumed")
    expect(function() iddata.read(path, { u = 1, y = 1 }) end):fails "column1 is both an output and an input"
  end
  said(iddata.read(file(".csv", "u,y\n1,2\n3,4\n")), "assumed")
  expect(tostring(iddata.read(file(".csv", "u,y\n1,2\n3,4\n"), { Ts = 1 })):find "assumed"):equals(nil)
end)

test("offsets that no term of the model holds", function()
  local y, u = {}, {}
  for t = 1, 60 do u[t] = (-1)^(t * t // 3); y[t] = 97 + 0.5 * math.sin(t * t) + u[t] end
  local d = iddata { y = y, u = u }
  said(arx(d, { na = 1, nb = 1 }), "d:detrend()")
  said(armax(d, { na = 1, nb = 1, nc = 1 }), "d:detrend()")
  expect(tostring(arx(d:detrend(), { na = 1, nb = 1 })):find "detrend"):equals(nil)
  local step = {}
  for t = 1, 60 do u[t] = 1; step[t] = 1 - 0.5^(t - 1) end
  expect(tostring(oe(iddata { y = step, u = u }, { nb = 1, nf = 1 })):find "detrend"):equals(nil)
end)

test("correlation at lag 0, the end of a range, inputs that depend on each other", function()
  local u, y = {}, {}
  for t = 1, 200 do u[t] = math.sin(t * t * 1.3); y[t] = -u[t] + 0.3 * (u[t-1] or 0) + 0.5 * math.sin(t^3) end
  local d = iddata { y = y, u = u }
  said(arx(d, { na = 1, nb = 1 }):validate(d), "at lag 0): take nk = 0")
  expect(tostring(arx(d, { na = 1, nb = 2, nk = 0 }):validate(d)):find "at lag 0"):equals(nil)
  said(order_scan(d, { na = {1, 2}, nb = {1, 3}, nk = {1, 2} }), "at the end of the range")
  local u2, z = {}, {}
  for t = 1, 200 do u2[t] = 2 * u[t]; z[t] = 0.5 * (z[t-1] or 0) + (u[t-1] or 0) + 0.01 * math.sin(t^3) end
  said(n4sid(iddata { y = z, u = { u, u2 } }, { order = 1 }), "only B(u1) + 2 B(u2) is determined")
end)

test("orders per output with one input, orders beyond the data, starts that are no numbers", function()
  local y1, y2, u = {}, {}, {}
  for t = 1, 80 do
    u[t] = (-1)^(t * t // 3)
    y1[t], y2[t] = 0.5 * (y1[t-1] or 0) + (u[t-1] or 0), 0.2 * (y2[t-1] or 0) + 3 * (u[t-1] or 0)
  end
  local d = iddata { y = { y1, y2 }, u = u }
  local m = arx(d, { na = {{1, 0}, {0, 1}}, nb = {{1}, {1}} })
  expect(compare(d, m)[1].prediction.rows):equals(2)
  expect(function() arx(d, { na = 1, nb = {1, 1, 1} }) end):fails "nb"
  local one = d:select { y = 1 }
  expect(function() arx(one, { na = 1e9, nb = 1 }) end):fails "at most 999999"
  expect(function() arx(one, { na = 1.5, nb = 1 }) end):fails "whole number, got 1.5"
  expect(function() armax(one, { na = 1, nb = 1, nc = 1, start = { 0/0, 1, 1 } }) end):fails "entry 1"
end)

test("what stands before the data has one name", function()
  local d = iddata { y = { 0, 2, 1, 4, 2 }, u = { 1, 0.5, 2, 1, 0 } }
  local m = arx(d, { na = 1, nb = 1 })
  for _, ic in ipairs { "zero", "data", "estimate", "drop" } do
    expect(m:predict(d, { ic = ic }).rows):equals(5)
    expect(m:simulate(d, { ic = ic }).rows):equals(5)
  end
  expect(function() m:predict(d, { ic = "none" }) end):fails "unknown ic"
end)

test("sets of parameters do not depend on units", function()
  local function set(unit)
    local y, u = {}, {}
    for t = 1, 50 do u[t] = unit * (-1)^(t * t // 3); y[t] = math.sin(t) end
    return arx(iddata { y = y, u = u }, { na = 1, nb = 1, nk = 0, noise = uniform(-5, 5), ic = "zero" })
  end
  local one = set(1)
  for _, unit in ipairs { 1e-24, 1e-9, 1e9, 1e24 } do
    local s = set(unit)
    expect(s.vertices.rows):equals(one.vertices.rows)
    expect(s.box[1][1]):near(one.box[1][1], 1e-9)
    expect(s.box[2][2] * unit):near(one.box[2][2], 1e-9)
    expect(evaluate(s.volume) * unit / evaluate(one.volume)):near(1, 1e-8)
  end
end)

test("the verdict of a search", function()
  local d = iddata.read("scripts/data/hairdryer.csv", { y = "y_temp", u = "u_voltage", Ts = 0.08 })
  local e = d:detrend():slice(1, 500)
  said(bj(e, { nb = 2, nc = 2, nd = 2, nf = 2, nk = 3 }), "search: a minimum (slope")
  local u, y = {}, {}
  for t = 1, 200 do u[t] = (-1)^((t * t // 3 + t // 7) % 2); y[t] = 1.1 * (y[t-1] or 0) + (u[t-1] or 0) end
  said(oe(iddata { y = y, u = u }, { nb = 1, nf = 1 }), "zero of F on the unit circle")
end)

-- Too little to say anything: every estimator refuses in its own words.
test("three samples, constant inputs and gaps are refused by name", function()
  local three, u, y = iddata { y = { 1, 2, 3 }, u = { 1, 0, 1 } }, {}, {}
  for t = 1, 60 do u[t], y[t] = 2, 1 + t % 3 / 10 end
  local constant = iddata { y = y, u = u }
  for t = 1, 60 do u[t] = (t * t // 3) % 2 end
  u[30] = 0/0
  local gap = iddata { y = y, u = u }
  local basis = { nb = 1, nf = 1, input = { function(v) return v end, function(v) return v^2 end } }
  local all = { { tfest, "tfest", { np = 2 } }, { process_model, "process_model", "P1D" }, { spa, "spa" },
    { etfe, "etfe" }, { cra, "cra" }, { impulse_estimate, "impulse_estimate" }, { coherence, "coherence" },
    { hammerstein, "hammerstein", basis } }
  for _, each in ipairs(all) do
    local f, name, options = table.unpack(each)
    if name ~= "hammerstein" and name ~= "etfe" then
      expect(function() f(three, options) end):fails(name .. ": 3 samples are too few")
    end
    expect(function() f(constant, options) end):fails(name .. ": the input u does not vary")
    expect(function() f(gap, options) end):fails(name)
  end
  expect(function() delay_estimate(constant) end):fails "delay_estimate: the input u does not vary"
  expect(process_model(iddata { y = y, u = constant.u }, "P1", { ic = "zero" }).theta[1] > 0):is_true()
end)

test("a search that starts beside where residuals exist says so", function()
  expect(function() nlsq(function(p) return { math.sqrt(p[1]) - 1, p[1] } end, { 0 }) end):fails "next to it"
end)

test("state-space models are told of offsets, too", function()
  local u, y = {}, {}
  for t = 1, 120 do
    u[t] = (t * t // 3) % 2
    y[t] = 50 + 0.5 * ((y[t-1] or 50) - 50) + (u[t-1] or 0) + (t * 7 % 5) / 50
  end
  expect(tostring(n4sid(iddata { y = y, u = u }, 1)):find("d:detrend()", 1, true) ~= nil):is_true()
  expect(tostring(n4sid(iddata { y = y, u = u }:detrend(), 1)):find("d:detrend()", 1, true) == nil):is_true()
end)

test("a model estimated from rest reports a simulation from rest", function()
  local u, y = {}, {}
  for t = 1, 100 do
    u[t] = math.sin(t * t)
    y[t] = 0.5 * (y[t-1] or 0) + (u[t-1] or 0) + 0.1 * math.cos(t^3)
  end
  local d = iddata { y = y, u = u }
  local orders = { arx = { na = 1, nb = 1 }, armax = { na = 1, nb = 1, nc = 1 }, oe = { nb = 1, nf = 1 },
    bj = { nb = 1, nf = 1, nc = 1, nd = 1 } }
  for name, o in pairs(orders) do
    o.ic = "zero"
    local m = _G[name](d, o)
    said(m, ("%.6g %% (simulation, from rest)"):format(m:fit(d, { horizon = "simulation", ic = "zero" })))
    o.ic = nil
    expect(tostring(_G[name](d, o)):find "from rest"):equals(nil)
  end
end)

test("data whose squares overflow, in every estimator", function()
  for _, unit in ipairs { 1e160, 1e200 } do
    local u, y = {}, {}
    for t = 1, 100 do
      u[t] = math.sin(t * t)
      y[t] = unit * (0.5 * (y[t-1] or 0) / unit + (u[t-1] or 0) + 0.1 * math.cos(t^3))
    end
    local d = iddata { y = y, u = u }
    expect(function() arx(d, { na = 1, nb = 1 }) end):fails "scale the data"
    expect(function() armax(d, { na = 1, nb = 1, nc = 1 }) end):fails "scale the data"
    expect(function() oe(d, { nb = 1, nf = 1 }) end):fails "scale the data"
  end
end)

test("feedback in the data is said with its statistic", function()
  local u, y = {}, {}
  seed(4)
  local e = randn(500)
  for t = 1, 500 do
    u[t] = -0.5 * (y[t-1] or 0) + 0.3 * (-1)^(t * t // 7)
    y[t] = 0.8 * (y[t-1] or 0) + (u[t-1] or 0) + 0.5 * e[t]
  end
  local text = tostring(arx(iddata { y = y, u = u }, { na = 1, nb = 1 }):validate(iddata { y = y, u = u }))
  local outside, lags = text:match "later inputs are correlated %(u: (%d+) of (%d+) correlations outside ±"
  expect(tonumber(outside) > 1):is_true()
  expect(tonumber(lags)):equals(25)
  said(text, "may have been taken in closed loop")
end)

test("ic and its former name are one option", function()
  local d = iddata { y = { 1, 2, 3 }, u = { 1, 1, 1 } }
  local m = idpoly { A = {1, -0.5}, B = {1} }
  expect(m:predict(d, { ic = "zero" })):near(m:predict(d, { init = "zero" }), 0)
  expect(function() m:predict(d, { ic = "zero", init = "data" }) end):fails "give ic alone"
  expect(function() m:simulate(d, { ic = "nought" }) end):fails "unknown ic"
end)

local function far_from_zero()
  seed(7)
  local r, u, y, x = randn(200), {}, {}, 0
  for t = 1, 200 do
    x = 0.9 * x + 0.5 * (t > 1 and r[t - 1] or 0)
    u[t], y[t] = 1e6 + r[t], 1e6 + x
  end
  return iddata { y = y, u = u }
end

test("every estimator says that the data stand far from 0", function()
  local d, same = far_from_zero(), { function(x) return x end }
  for _, m in ipairs { rarx(d, { na = 1, nb = 1 }), process_model(d, "P1"), tfest(d, { np = 1 }),
    hammerstein(d, { nb = 1, nf = 1, input = same }), arx(d, { na = 1, nb = 1 }) } do
    expect(tostring(m):find("d:detrend() removes it", 1, true) ~= nil):is_true()
  end
end)

test("inputs that depend on each other: kernels find numbers, uncertain refuses", function()
  seed(9)
  local N, r, s, e = 200, randn(200), randn(200), randn(200)
  local u, y = { {}, {}, {} }, {}
  for t = 1, N do
    u[1][t], u[2][t], u[3][t] = r[t], s[t], 2 * r[t] - s[t]
    y[t] = 0.7 * (y[t - 1] or 0) + (u[1][t - 1] or 0) + 0.5 * (u[2][t - 1] or 0) + 0.1 * e[t]
  end
  local d = iddata { y = y, u = u }
  for _, kernel in ipairs { "TC", "DC" } do
    local m = fir(d, { nb = { 5, 5, 5 }, kernel = kernel })
    expect(m:fit(d) > 80):is_true()
  end
  local m = arx(d, { na = 1, nb = { 1, 1, 1 } })
  expect(function() uncertain(m, { input = 1 }) end):fails "not identifiable"
  expect(function() return pem(d, n4sid(d, 1)).cov end):fails "the inputs depend on each other"
end)

test("functions of a basis that depend on each other", function()
  seed(3)
  local u, y, r = {}, {}, randn(100)
  for t = 1, 100 do u[t], y[t] = r[t], 0.5 * (y[t - 1] or 0) + (u[t - 1] or 0) + 0.01 * math.sin(t * t) end
  local twice = { function(x) return x end, function(x) return 2 * x end }
  local text = tostring(hammerstein(iddata { y = y, u = u }, { nb = 1, nf = 1, input = twice }))
  expect(text:find("functions of a basis depend on each other", 1, true) ~= nil):is_true()
end)

test("spectra: frequencies above the Nyquist frequency, records of a few samples", function()
  local d = far_from_zero()
  expect(function() spa(d, { w = { 1, 4 } }) end):fails "0 to π/Ts = 3.14159 rad/s"
  expect(function() welch(d) end):fails "welch(d.y, { Ts = d.Ts })"
  expect(function() welch({ 1, 2, 1 }) end):fails "at least 4"
  expect(#welch({ 1, 2, 1, 3, 1 }).f):equals(3)
end)
