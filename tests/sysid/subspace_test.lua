-- State-space models by subspaces: exact recovery, agreement with the truth on noise, other roads, bad input.
local function generator(s) return function() s = (1103515245 * s + 12345) % 2147483648
  return s / 1073741824 - 1 end end

local A = { { 0.5, 0.2, 0 }, { -0.1, 0.7, 0.1 }, { 0, 0.3, -0.4 } }
local G = ss(A, { { 1, 0 }, { 0, 1 }, { 0.5, 0.5 } }, { { 1, 0, 1 }, { 0, 1, 0 } }, { { 0, 0 }, { 0, 0 } }, 1)
local rows, N = {}, 200
do
  local r = generator(5)
  for t = 1, N do rows[t] = { r(), r() } end
end
local U = mat(rows)
local clean = iddata { y = lsim(G, U, nil).y, u = U, Ts = 1 }

-- C A^(k-1) B, which no choice of coordinates changes
local function markov(g, k)
  local p = g.B
  for _ = 2, k do p = g.A * p end
  return g.C * p
end

test("noise-free data are recovered to rounding, by every weighting", function()
  for _, weight in ipairs { "CVA", "MOESP", "N4SID" } do
    local m = n4sid(clean, { order = 3, weight = weight })
    expect(m.exact[1] and m.exact[2]):is_true()
    for k = 1, 6 do expect(markov(m:ss(), k)):near(markov(G, k), 1e-11) end
    expect(m:simulate(clean)):near(clean.y, 1e-10)
    expect(m:predict(clean)):near(clean.y, 1e-10)
  end
  expect(n4sid(clean).orders.order):equals(3)              -- the order is the rank
  local D = ss(A, { 1, 0, 0.5 }, { 1, 0, 1 }, 2, 1)
  local u = U:block(1, N, 1, 1)
  local m = n4sid(iddata { y = lsim(D, u, nil).y, u = u }, { order = 3, D = true })
  expect(m.D[1]):near(2, 1e-11)
  expect(m:dcgain()):near(evaluate(D:dcgain(), {}), 1e-10)
end)

test("an unstable system in its own data", function()
  local y, u, r = { 0 }, {}, generator(8)
  for t = 1, 60 do u[t] = r() y[t+1] = 1.1 * y[t] + u[t] end
  y[61] = nil
  local m = n4sid(iddata { y = y, u = u }, 1)
  expect(m.A[1]):near(1.1, 1e-10)
  expect(m.C[1] * m.B[1]):near(1, 1e-9)
end)

test("with noise the poles are within their scatter, and more data come closer", function()
  local function record(n, seed)
    local r, x1, x2, u, y = generator(seed), 0, 0, {}, {}
    for t = 1, n do
      u[t] = r()
      local e = 0.1 * (r() + r() + r())
      y[t] = x1 + e                                        -- A = [1.5 1; -0.7 0], C = [1 0], K = [0.8, -0.3]
      x1, x2 = 1.5 * x1 + x2 + u[t] + 0.8 * e, -0.7 * x1 + 0.5 * u[t] - 0.3 * e
    end
    return iddata { y = y, u = u }
  end
  local function far(m)
    local c = m:ss():charpoly()
    return math.max(math.abs(c[2] + 1.5), math.abs(c[3] - 0.7))
  end
  local small, large = n4sid(record(500, 3), 2), n4sid(record(20000, 4), 2)
  expect(far(small) < 0.05):is_true()
  expect(far(large) < 0.005):is_true()
  expect(large.noise_variance(1, 1)):near(0.01, 0.0005)    -- variance of the sum of three uniform numbers: 1
  expect(n4sid(record(20000, 4)).orders.order):equals(2)
  -- the one-step errors of the innovations form are white; the same without K are not
  local d = record(2000, 6)
  expect(n4sid(d, 2):validate(d).white):is_true()
  expect(n4sid(d, { order = 2, K = false }):validate(d).white):equals(false)
  -- K is the gain of the predictor: H = C (zI - A)⁻¹ K + 1 has the poles' numerator z² - (1.5 - 0.8) z + (0.7
  -- - 0.3)
  local h = large:tf "noise"
  expect(h.num[2] / h.num[1]):near(-0.7, 0.05)
  -- the gain solves the Riccati equation of the filter: predictions beat every other K nearby
  expect(n4sid(d, 2):fit(d) > n4sid(d, { order = 2, K = false }):fit(d)):is_true()
end)

test("prediction, simulation and k steps by hand", function()
  local r, noisy = generator(9), {}
  for t = 1, N do noisy[t] = { clean.y(t, 1) + 0.05 * r(), clean.y(t, 2) + 0.05 * r() } end
  local d = iddata { y = noisy, u = rows }
  local m = n4sid(d, 3)
  local A_, B_, C_, K_ = m.A, m.B, m.C, m.K
  local x, y2 = zeros(3, 1), m:predict(d, { horizon = 3, init = "zero" })
  local one, free = m:predict(d, { init = "zero" }), m:simulate(d, { init = "zero" })
  local s = zeros(3, 1)
  local filtered = {}
  for t = 1, 40 do
    local u = vec { rows[t][1], rows[t][2] }
    local y = vec { noisy[t][1], noisy[t][2] }
    filtered[t] = x
    expect(one[t]):near((C_ * x).T, 1e-10)
    expect(free[t]):near((C_ * s).T, 1e-10)
    -- two steps ahead of the filter, without measurements
    if t >= 3 then
      local ahead = filtered[t-2]
      for k = t - 2, t - 1 do
        local e = k == t - 2 and vec { noisy[k][1], noisy[k][2] } - C_ * ahead or nil
        ahead = A_ * ahead + B_ * vec { rows[k][1], rows[k][2] }
      end
      expect(y2[t]):near((C_ * ahead).T, 1e-10)
    end
    s = A_ * s + B_ * u
    x = A_ * x + B_ * u + K_ * (y - C_ * x)
  end
end)

test("several experiments, time series, comparison with other classes", function()
  local two = n4sid(merge(clean:slice(1, 90), clean:slice(101, 200)), 3)
  expect(two.x0.cols):equals(2)
  expect(markov(two:ss(), 4)):near(markov(G, 4), 1e-10)
  local r, x, e = generator(12), {}, {}
  for t = 1, 4000 do
    e[t] = r() + r() + r()
    x[t] = 0.8 * (x[t-1] or 0) + e[t] + 0.5 * (e[t-1] or 0)
  end
  local m = n4sid(iddata { y = x }, 1)
  expect(m.A[1]):near(0.8, 0.05)                           -- std of a pole at 0.8 from 4000 samples: 0.01
  local d = iddata { y = lsim(G, U, nil).y:block(1, N, 1, 1), u = U }
  local c = compare(d, { state = n4sid(d, 3), arx = arx(d, { na = 1, nb = 1 }) })
  expect(c.state.simulation > c.arx.simulation):is_true()
end)

test("outputs that feed each other: the state space of a coupled ARX model", function()
  local m = arx(clean, { na = 3, nb = 3 })
  expect(markov(m:ss(), 4)):near(markov(G, 4), 1e-9)
  -- an estimate is not refused because its free simulation diverges
  local r, y = generator(3), { { 0, 0 }, { 0.1, 0 } }
  for t = 3, 400 do y[t] = { 3 * y[t-1][2] - 2.5 * y[t-2][1] % 1, y[t-1][1] % 1 + 0.1 * r() } end
  local grows = arx(iddata { y = y }, { na = 2 })
  expect(tostring(grows):find "simulation" ~= nil):is_true()
end)

test("bad input is refused with the reason", function()
  expect(function() n4sid(clean, 0) end):fails "order must lie between 1 and 100"
  expect(function() n4sid(clean, { order = { 3, 1 } }) end):fails "is not a range"
  expect(function() n4sid(clean, { order = 2, weight = "cvx" }) end):fails "Did you mean 'CVA'"
  expect(function() n4sid(clean, { order = 20, horizon = 3 }) end):fails "horizon"
  expect(function() n4sid(clean:slice(1, 20), 3) end):fails "too few"
  expect(function() return n4sid(clean, 3).theta end):fails "depend on the coordinates"
  expect(function() return arx(clean, { na = 1, nb = 1 }).K end):fails "belongs to state-space models"
  expect(function() n4sid(iddata { y = { 1, 2, 3, 1, 2, 3 }, u = { 1, 0/0, 3, 4, 5, 6 } },
    1) end):fails "d:fill()"
  local flat = {}
  for t = 1, 60 do flat[t] = 1 end
  expect(function() n4sid(iddata { y = flat, u = flat }, 1) end):fails "do not determine a model of order 1"
end)
