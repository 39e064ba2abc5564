-- Linear least squares: published digits, exact recovery, rank reports.
local function csv(rows)  -- a small deterministic stream, the same on every machine
  local s = 12345
  return function()
    s = (1103515245 * s + 12345) % 2147483648
    return s / 1073741824 - 1
  end
end

test("six samples: the numbers of the hand calculation", function()
  local d = iddata { y = { 0, 1, .6, -.7, 1.5, 1.9 }, u = { 1, 0, -1, 2, 1, 0 } }
  local m = arx(d, { na = 1, nb = 1, nk = 1 })
  expect(m.theta):near({ -0.60316344464, 0.985940246046 }, 1e-11)
  expect(m.sigma2):near(0.002843585237, 1e-12)
  expect(m.cov(1, 1)):near(6.996519037e-4, 1e-12)
  expect(m.cov(2, 2)):near(4.097961150e-4, 1e-12)
  expect(m.rows):equals(5)
  expect(m.A):near({ 1, -0.60316344464 }, 1e-11)
  expect(m.B):near({ 0, 0.985940246046 }, 1e-11)
  expect(m:fit(d)):near(m.fit_percent, 1e-12)
  local e = m:residuals(d)
  expect(#e):equals(5)
  expect(dot(e, e) / 5):near(m.loss, 1e-14)
end)

test("exam 2(d): rank 1, b = 1, a free, minimum norm (0, 1)", function()
  local m = arx(iddata { y = { 0, 1 }, u = { 1, 0 } }, { na = 1, nb = 1, nk = 1 })
  expect(m.rank):equals(1)
  expect(m.theta):near({ 0, 1 }, 1e-15)
  expect(m.unidentifiable[1]):equals "a1 is not identifiable"
  expect(m.std[1]):equals(math.huge)
  expect(m.exact):is_true()
end)

test("noise-free data give the parameters to rounding", function()
  local r = csv()
  local y, u1, u2 = { 0, 0, 0 }, {}, {}
  for t = 1, 200 do u1[t], u2[t] = r(), r() end
  for t = 4, 200 do y[t] = 1.2 * y[t-1] - 0.5 * y[t-2] + u1[t-1] + 0.25 * u1[t-2] - 2 * u2[t-3] end
  local d = iddata { y = y, u = { u1, u2 } }
  local m = arx(d, { na = 2, nb = { 2, 1 }, nk = { 1, 3 } })
  expect(m.theta):near({ -1.2, 0.5, 1, 0.25, -2 }, 1e-13)
  expect(m.exact):is_true()
  expect(m.names[5]):equals "b3(u2)"
  expect(m.B[2]):near({ 0, 0, 0, -2 }, 1e-13)
  expect(m:simulate(d)):near(d.y, 1e-12)
  expect(tostring(m):find("exact to rounding", 1, true) ~= nil):is_true()
  -- too high orders: common factors are free, and it says so
  local high = arx(d, { na = 3, nb = { 3, 2 }, nk = { 1, 3 } })
  expect(high.rank):equals(7)
  expect(high.advice[1]:find("lower na and nb by one", 1, true) ~= nil):is_true()
  expect(high:simulate(d)):near(d.y, 1e-10)
end)

test("several outputs", function()
  local r = csv()
  local u, a, b = {}, { 0 }, { 0 }
  for t = 1, 100 do u[t] = r() end
  for t = 2, 100 do
    a[t] = 0.5 * a[t-1] + 0.2 * b[t-1] + u[t-1]
    b[t] = -0.3 * a[t-1] + 0.4 * b[t-1]
  end
  local d = iddata { y = { a, b }, u = u }
  local m = arx(d, { na = { { 1, 1 }, { 1, 1 } }, nb = 1, nk = 1 })
  expect(m.theta[1]):near({ -0.5, 1, 0.2 }, 1e-13)
  expect(m.theta[2]):near({ -0.4, 0, -0.3 }, 1e-13)
  expect(m:simulate(d)):near(d.y, 1e-12)
end)

test("start of the regressor", function()
  local y, u = { 1 }, { 1, -1, 2, 0, -2, 1, 3, -1 }
  for t = 2, 8 do y[t] = 0.5 * y[t-1] + u[t] end
  y[1] = 1                                                 -- from rest: 0.5·0 + u(1)
  local d = iddata { y = y, u = u }
  expect(arx(d, { na = 1, nb = 1, nk = 0, ic = "zero" }).rows):equals(8)
  expect(arx(d, { na = 1, nb = 1, nk = 0 }).rows):equals(7)
  expect(arx(d, { na = 1, nb = 1, nk = 0, ic = "zero" }).theta):near({ -0.5, 1 }, 1e-15)
  local shifted = d:slice(3, 8)                            -- y(0) of the slice is y(2) of the record
  local m = arx(shifted, { na = 1, nb = 1, nk = 0, ic = "estimate" })
  expect(m.theta):near({ -0.5, 1 }, 1e-14)
  expect(tostring(m):find("y(0) = " .. ("%g"):format(y[2]), 1, true) ~= nil):is_true()
end)

test("a poor input is named with its order", function()
  local d = iddata { y = { 1, 2, 3, 2, 1, 2 }, u = { 1, 1, 1, 1, 1, 1 }, uname = "flow" }
  local m = fir(d, { nb = 2 })
  expect(m.rank):equals(1)
  expect(m.unidentifiable[1]:find("only b1 + b2 is determined", 1, true) ~= nil):is_true()
  expect(m.advice[1]):equals(
    "the input flow does not vary: it is persistently exciting of order 1, nb = 2 needs order 2; excite with prbs(…) or multisine(…), or lower nb")
  local loop = iddata { y = { 1, .5, -.2, .9, .4, -1, .3, .8 }, u = { -1, -.5, .2, -.9, -.4, 1, -.3, -.8 } }
  local m2 = arx(loop, { na = 1, nb = 1 })                 -- u = -y
  expect(m2.rank):equals(1)
  expect(m2.advice[1]:find("feedback", 1, true) ~= nil):is_true()
end)

test("the hairdryer, to the digits of other tools", function()
  local d = iddata.read("scripts/data/hairdryer.csv", { y = "y_temp", u = "u_voltage", Ts = 0.08 })
  local m = arx(d:slice(1, 300):detrend(), { na = 2, nb = 2, nk = 3 })
  expect(m.theta):near({ -1.27373875, 0.393546077, 0.0666178822, 0.0444818773 }, 6e-9)  -- printed to 9 digits
  expect(m.std):near({ 0.02091, 0.01910, 0.002138, 0.003317 }, 5e-6)
  expect(m.rows):equals(296)
  expect(m.loss):near(0.0016853093, 1e-10)
  expect(m.fpe):near(0.0017314821, 1e-10)
  expect(m.fit_percent):near(95.1195, 1e-6)
end)

test("lsq: weights, covariance, rank", function()
  local A, y = { { 1, 0 }, { 1, 1 }, { 1, 2 } }, { 1, 2, 4 }
  local r = lsq(A, y)
  expect(r.theta):near({ 5/6, 3/2 }, 1e-14)                -- normal equations by hand
  expect(r.sigma2):near(1/6, 1e-14)
  expect(r.covariance):near(mat { { 5/36, -1/12 }, { -1/12, 1/12 } }, 1e-14)
  expect(dot(vec { 1, 1, 1 }, r.residuals)):near(0, 1e-14)
  local S = mat { { 2, 1, 0 }, { 1, 2, 0 }, { 0, 0, 1 } }
  -- (AᵀS⁻¹A)⁻¹AᵀS⁻¹y, docs/derivations.md#regression, exactly
  local g = lsq(A, y, { covariance = S })
  local B = mat(A)
  local cov = inv(B.T * inv(S) * B)
  expect(g.covariance):near(cov, 1e-14)
  expect(g.theta):near(cov * B.T * inv(S) * vec(y), 1e-14)
  expect(lsq(A, y, { covariance = { 4, 1, 1 } }).theta):near(lsq(A, y, { weights = { 0.25, 1, 1 } }).theta,
    1e-14)
  local free = lsq({ { 1, 2 }, { 2, 4 } }, { 3, 6 }, { names = { "p", "q" } })
  expect(free.rank):equals(1)
  expect(free.theta):near({ 0.6, 1.2 }, 1e-14)
  expect(free.unidentifiable[1]:find("only p + 2 q is determined", 1, true) ~= nil):is_true()
  expect(function() lsq(A, { 1, 2 }) end):fails "A has 3 rows but y has 2"
  expect(function() lsq(A, y, { covariance = { { 1, 2, 0 }, { 2, 1, 0 },
    { 0, 0, 1 } } }) end):fails "not positive definite"
  expect(function() lsq(A, y, { weights = { 1, -1, 1 } }) end):fails "not negative"
  expect(function() lsq({ { 1, 0/0 } }, { 1 }) end):fails "nan"
end)

test("weights and a covariance of the noise, by lsq on the regressor", function()
  local d = iddata { u = { 1, -1, 2, 0, -2, 1, 3, -1 }, y = { 1.2, -.1, 1.9, .4, -2.1, -.2, 2.6, .5 } }
  local orders = { na = 1, nb = 1 }
  local Phi, y, names = regressor(d, orders)
  expect(Phi.rows):equals(7)
  expect(names[2]):equals "b1"
  expect(lsq(Phi, y).theta):near(arx(d, orders).theta, 1e-13)
  local w = { 1, 2, 3, 4, 5, 6, 7, 8 }
  local rest = { 2, 3, 4, 5, 6, 7, 8 }                      -- the first sample starts the regressor
  local m = arx(d, { na = 1, nb = 1, weights = w })
  expect(m.theta):near(lsq(Phi, y, { weights = rest }).theta, 1e-13)
  expect(arx(d, { na = 1, nb = 1, weights = rest }).theta):equals(m.theta)
  expect(tostring(m):find("weighted least squares", 1, true) ~= nil):is_true()
  local S = {}
  for i = 1, 8 do S[i] = {} for j = 1, 8 do S[i][j] = 0.5 ^ math.abs(i - j) end end
  local sub = mat(S):block(2, 8, 2, 8)
  local c = arx(d, { na = 1, nb = 1, covariance = S })
  local l = lsq(Phi, y, { covariance = sub })
  expect(c.theta):near(l.theta, 1e-13)
  expect(c.cov):near(l.cov, 1e-13)
  expect(c.cov):near(inv(Phi.T * inv(sub) * Phi), 1e-12)    -- docs/derivations.md#regression
  expect(arx(d, { na = 1, nb = 1, covariance = 0.01 }).theta):near(arx(d, orders).theta, 1e-13)
  expect(function() arx(d, { na = 1, nb = 1, weights = { 1, 2 } }) end):fails "one per sample"
  expect(function() arx(d, { na = 1, nb = 1, weights = w, covariance = S }) end):fails "give one of"
end)
