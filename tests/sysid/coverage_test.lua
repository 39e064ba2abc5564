-- Do 95 % intervals cover the truth in 95 % of the cases? Every estimator on simulated records. In CI a short
-- seeded
-- version; the campaign: COVERAGE_RUNS=2000 pendula test tests/sysid/coverage_test.lua
local runs = math.tointeger(tonumber(os.getenv "COVERAGE_RUNS" or "")) or 30
local z = 1.959964

-- y from A y = B u + C e, or y = B/F u + e
local function record(N, a, b, c, f, noise)
  local e, w, u, y = randn(N), {}, {}, {}
  local p = randn(N)
  for t = 1, N do
    u[t] = p[t]
    local sum = 0
    for k = 1, #b do sum = sum + b[k] * (u[t-k] or 0) end
    if f then
      for k = 1, #f do sum = sum - f[k] * (w[t-k] or 0) end
      w[t] = sum
      y[t] = sum + noise * e[t]
    else
      for k = 1, #a do sum = sum - a[k] * (y[t-k] or 0) end
      sum = sum + noise * e[t]
      for k = 1, #c do sum = sum + noise * c[k] * (t > k and e[t-k] or 0) end
      y[t] = sum
    end
  end
  return iddata { y = y, u = u }
end

local function covers(name, truth, estimate)
  test(name .. ": 95 % intervals", function()
    seed(20)
    local inside, count = 0, 0
    for _ = 1, runs do
      local theta, std = estimate()
      for k, v in ipairs(truth) do
        if math.abs(theta[k] - v) < z * std[k] then inside = inside + 1 end
        count = count + 1
      end
    end
    local share = inside / count
    -- parameters of one fit are correlated: as many independent cases as runs
    local slack = runs >= 1000 and 0.02 or 3.3 * math.sqrt(0.95 * 0.05 / runs)
    if not (math.abs(share - 0.95) < slack) then error(("%s covers %.1f %%"):format(name, 100 * share)) end
  end)
end

local function both(m) return m.theta, m.std end
local a, b, c = { -1.2, 0.5 }, { 1, 0.5 }, { 0.6 }
covers("arx", { -1.2, 0.5, 1, 0.5 }, function()
  return both(arx(record(300, a, b, {}, nil, 0.5), { na = 2, nb = 2 }))
end)
covers("fir", { 1, 0.5 }, function() return both(fir(record(200, {}, b, {}, nil, 0.5), { nb = 2 })) end)
covers("armax", { -1.2, 0.5, 1, 0.5, 0.6 }, function()
  return both(armax(record(400, a, b, c, nil, 0.5), { na = 2, nb = 2, nc = 1 }))
end)
covers("oe", { 1, 0.5, -1.2, 0.5 }, function()
  return both(oe(record(400, {}, b, {}, a, 0.5), { nb = 2, nf = 2 }))
end)
covers("bj", { 1, 0.5, -1.2, 0.5 }, function()
  local m = bj(record(400, {}, b, {}, a, 0.5), { nb = 2, nf = 2, nc = 0, nd = 1 })
  return { m.theta[1], m.theta[2], m.theta[4], m.theta[5] }, { m.std[1], m.std[2], m.std[4], m.std[5] }
end)
covers("iv4", { -1.2, 0.5, 1, 0.5 }, function()
  return both(iv4(record(600, a, b, c, nil, 0.5), { na = 2, nb = 2 }))
end)
covers("armax with a tenth of the samples missing", { -0.7, 1, 0.5 }, function()
  local d, y, q = record(200, { -0.7 }, { 1 }, { 0.5 }, nil, 0.5), {}, rand(200)
  for t = 1, 200 do y[t] = q[t] < 0.1 and 0/0 or d.y(t, 1) end
  return both(armax(iddata { y = y, u = d.u }, { na = 1, nb = 1, nc = 1 }))
end)
covers("rarx", { -0.7, 1 }, function()
  local r = rarx(record(300, { -0.7 }, { 1 }, {}, nil, 0.5), { na = 1, nb = 1 })
  return r.theta[300], r.std[300]
end)
covers("process model", { 3, 5, 1.3 }, function()
  local u, y, e = {}, {}, randn(150)
  for t = 1, 150 do u[t] = (t // 17) % 2 + 0.3 * ((t // 5) % 2) end
  local clean = held_response({3}, {5, 1}, 1.3, u, 1)
  for t = 1, 150 do y[t] = clean[t] + 0.1 * e[t] end
  return both(process_model(iddata { y = y, u = u }, "P1D", { ic = "zero" }))
end)
