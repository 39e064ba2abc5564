-- Maximum likelihood: the polytope of uniform noise, and the estimators of other densities.
local d = iddata { u = { 1, -1, 2, 0, -2, 1, 3, -1 }, y = { 1.2, -.1, 1.9, .4, -2.1, -.2, 2.6, .5 } }
local orders = { na = 1, nb = 1, nk = 0, ic = "zero" }
local function with(noise) return { na = 1, nb = 1, nk = 0, ic = "zero", noise = noise } end

local function stream(seed)
  local s = seed
  return function()
    s = (1103515245 * s + 12345) % 2147483648
    return s / 1073741824 - 1
  end
end

test("the exam's set, in rational numbers", function()
  local set = arx(d, with(uniform(-1, 1)))
  expect(set.feasible and set.bounded and set.exact):is_true()
  local q = rational
  expect(#set.vertices):equals(4)
  local wanted = { { "-14/19", "53/76" }, { "-1/48", "133/240" }, { "-21/76", "463/380" },
    { "-14/19", "356/285" } }
  for i, v in ipairs(wanted) do
    expect(set.vertices(i, 1)):equals(mat { { v[1] } }[1])
    expect(set.vertices(i, 2)):equals(mat { { v[2] } }[1])
  end
  expect(set.volume):equals(mat { { "240209/693120" } }[1])
  expect(tostring(set):find("area 240209/693120", 1, true) ~= nil):is_true()
  expect(set.box[1].low):equals(mat { { "-14/19" } }[1])
  expect(set.box[2][2]):equals(mat { { "356/285" } }[1])
  for i = 1, 4 do expect(set:contains(set.vertices[i])):is_true() end
  -- the ball touches three sides: distance of the centre to every active constraint is at least the radius
  local c = set.center
  expect(set:contains(c)):is_true()
  for a = 0, 6.2, 0.1 do
    expect(set:contains { c[1] + 0.999 * set.radius * math.cos(a),
      c[2] + 0.999 * set.radius * math.sin(a) }):is_true()
  end
end)

test("empty: the smallest bound and the rows that decide", function()
  local set = arx(d, with(uniform(-0.3, 0.3)))
  expect(set.feasible):equals(false)
  expect(set.volume):equals(0)
  expect(#set.deciding):equals(3)                          -- d + 1 rows meet at the minimax point
  local bound = set.smallest_bound
  expect(arx(d, with(uniform(-bound * 1.0001, bound * 1.0001))).feasible):is_true()
  expect(arx(d, with(uniform(-bound * 0.9999, bound * 0.9999))).feasible):equals(false)
  expect(function() local _ = set.center and set.radius end):fails "the set is empty"
  expect(tostring(set):find("smallest feasible bound: |e| ≤ 0.3780952", 1, true) ~= nil):is_true()
end)

test("unbounded directions are named", function()
  local set = arx(iddata { y = { 0, 1 }, u = { 1, 0 } }, { na = 1, nb = 1, nk = 1, noise = uniform(-1, 1) })
  expect(set.feasible):is_true()
  expect(set.bounded):equals(false)
  expect(set.unidentifiable[1]):equals "a1 is not identifiable"
  expect(set.box[1].low):equals(-math.huge)
  expect(set.box[2].high):near(2, 1e-12)
  expect(function() local _ = set.vertices end):fails "unbounded"
end)

test("one point, and integer data with many coincidences", function()
  local one = lsq({ 1, 1 }, { 1, 3 }, { noise = uniform(-1, 1) })
  expect(#one.vertices):equals(1)
  expect(one.vertices[1]):equals(2)
  expect(tostring(one):find("unique", 1, true) ~= nil):is_true()
  -- the octahedron |x ± y ± z| ≤ 1: six vertices with eight facets, four meet in each; volume 4/3
  local A = { { 1, 1, 1 }, { 1, 1, -1 }, { 1, -1, 1 }, { 1, -1, -1 }, { 2, 2, 2 }, { 1, 1, 1 } }
  local set = lsq(A, { 0, 0, 0, 0, 0, 0 }, { noise = uniform(-1, 1) })
  expect(set.exact):is_true()
  -- |x+y+z| ≤ 1/2 cuts all six: two hexagons are left
  expect(#set.vertices):equals(12)
end)

test("the octahedron", function()
  local A = { { 1, 1, 1 }, { 1, 1, -1 }, { 1, -1, 1 }, { 1, -1, -1 }, { 1, 1, 1 } }
  local set = lsq(A, { 0, 0, 0, 0, 0 }, { noise = uniform(-1, 1) })
  expect(#set.vertices):equals(6)
  expect(set.volume):equals(mat { { "4/3" } }[1])
  local irrational = lsq(math.sqrt(2) * mat(A), { 0, 0, 0, 0, 0 },
    { noise = uniform(-math.sqrt(2), math.sqrt(2)) })
  expect(irrational.exact):equals(false)
  expect(#irrational.vertices):equals(6)
  expect(irrational.volume):near(4/3, 1e-12)
  -- the cube has volume 2^d in every dimension
  for n = 1, 5 do
    local cube = lsq(eye(n), zeros(n, 1), { noise = uniform(-1, 1) })
    expect(#cube.vertices):equals(2^n)
    expect(cube.volume):equals(math.tointeger(2^n))
  end
end)

test("the hairdryer with |e| ≤ 0.2", function()
  local e = iddata.read("scripts/data/hairdryer.csv", { Ts = 0.08 }):slice(1, 300):detrend()
  local set = arx(e, { na = 2, nb = 2, nk = 3, noise = uniform(-0.2, 0.2) })
  expect(#set.vertices):equals(192)
  expect(set.volume):near(0.000467592574, 5e-13)           -- printed to 9 digits
  for i = 1, 192 do expect(set:contains(set.vertices[i])):is_true() end
end)

test("the set contains the truth, its vertices lie on d rows, and more data only shrink it", function()
  local r = stream(7)
  local u, y = {}, {}
  for t = 1, 400 do
    u[t] = r()
    y[t] = 0.8 * (y[t-1] or 0) + u[t] + 0.5 * (u[t-1] or 0) + 0.1 * r()
  end
  local last = math.huge
  for _, n in ipairs { 20, 50, 100, 400 } do
    local set = arx(iddata { y = y, u = u }:slice(1, n),
      { na = 1, nb = 2, nk = 0, ic = "zero", noise = uniform(-0.1, 0.1) })
    expect(set:contains { -0.8, 1, 0.5 }):is_true()
    expect(set.volume <= last * (1 + 1e-9)):is_true()
    last = set.volume
    -- two roads to the intervals: vertices, and the sign of feasibility just inside and outside
    for i = 1, 3 do expect(set.box[i].low <= ({ -0.8, 1, 0.5 })[i]
      and ({ -0.8, 1, 0.5 })[i] <= set.box[i].high):is_true() end
  end
end)

test("laplace: medians, and the optimality condition of least absolute deviations", function()
  expect(lsq({ 1, 1, 1 }, { 1, 2, 9 }).theta[1]):near(4, 1e-14)
  local u, y, r = {}, {}, stream(3)
  for t = 1, 101 do u[t] = 1 y[t] = r() end
  local m = fir(iddata { y = y, u = u }, { nb = 1, nk = 0, noise = laplace() })
  local sorted = { table.unpack(y) }
  table.sort(sorted)
  expect(m.theta[1]):near(sorted[51], 1e-14)
  for t = 1, 101 do u[t] = r() y[t] = 2 * u[t] - (u[t-1] or 0) + 0.1 * r()^3 end
  local data = iddata { y = y, u = u }
  local best = fir(data, { nb = 2, nk = 0, noise = laplace() })
  local function cost(b0, b1)
    local sum = 0
    for t = 2, 101 do sum = sum + math.abs(y[t] - b0 * u[t] - b1 * u[t-1]) end
    return sum
  end
  local least = cost(best.theta[1], best.theta[2])
  for a = 0, 6.28, 0.2 do
    expect(cost(best.theta[1] + 1e-5 * math.cos(a), best.theta[2] + 1e-5 * math.sin(a)) >= least):is_true()
  end
end)

test("exponential: positive errors with the least sum", function()
  local u, y, r = {}, {}, stream(5)
  for t = 1, 200 do u[t] = r() y[t] = 2 * u[t] + 1 - math.log(0.5 * (1 + r()) + 1e-9) * 0.3 end
  local ones = {}
  for t = 1, 200 do ones[t] = 1 end
  local data = iddata { y = y, u = { u, ones } }
  local m = fir(data, { nb = { 1, 1 }, nk = { 0, 0 }, noise = exponential() })
  local touching = 0
  for t = 1, 200 do
    local e = y[t] - m.theta[1] * u[t] - m.theta[2]
    expect(e >= -1e-12):is_true()
    if e < 1e-9 then touching = touching + 1 end
  end
  expect(touching):equals(2)                               -- as many as parameters
  expect(m.theta[1]):near(2, 0.1)
  expect(function() return m.std end):fails "no standard deviation"
end)

test("gaussian and a user density agree with least squares", function()
  local m, g = arx(d, orders), arx(d, with(gaussian(0.5)))
  expect(g.theta):near(m.theta, 1e-14)
  expect(g.cov):near(m.cov * (0.25 / m.sigma2), 1e-13)
  local user = arx(d, with(density(function(e) return exp(-e^2 / 2 / 0.25) end)))
  expect(user.theta):near(m.theta, 1e-10)
  expect(user.cov):near(g.cov, 1e-10)
  expect(function() uniform(1, -1) end):fails "low must be below high"
  expect(function() gaussian(-1) end):fails "positive"
  expect(function() density(function(e) return 1 end) end):fails "does not depend on e"
  expect(function() arx(d, with(3)) end):fails "got a number (maximum likelihood: gaussian(s)"
  expect(function() arx(d, with(density(function(e)
    return ifelse(lt(abs(e), 0.01), 1 + e, 0) end))) end):fails "zero or undefined"
end)

test("lsq and linear predictors take every density", function()
  local A, y = { { 1 }, { 1 }, { 1 }, { 1 }, { 1 } }, { 3, 1, 2, 50, 5 }
  expect(lsq(A, y, { noise = laplace() }).theta[1]):near(3, 1e-9)                 -- the median
  expect(lsq(A, y, { noise = gaussian(1) }).theta[1]):near(12.2, 1e-12)           -- the mean
  expect(lsq(A, y, { noise = gaussian(2) }).std[1]):near(2 / math.sqrt(5), 1e-12)
  expect(lsq(A, y, { noise = exponential() }).theta[1]):near(1, 1e-9)             -- the least
  expect(lsq(A, y, { noise = uniform(-25, 25) }).box[1].low):equals(25)
  expect(lsq(A, y, { noise = density(function(e) return exp(-abs(e)) end) }).theta[1]):near(3, 1e-9)
  expect(lsq({ 1, 1, 1 }, { 1, 2, 5 }, { noise = density(function(e)
    return exp(-abs(e)) end) }).theta[1]):near(2, 1e-9)
  expect(lsq(A, y, { noise = function(e) return exp(-e^2/2) end }).theta[1]):near(12.2, 1e-9)
  expect(function() return lsq(A, y, { noise = exponential() }).std end):fails "corner"
  expect(function() lsq(A, y, { noise = laplace(), weights = { 1, 1, 1, 1, 1 } }) end):fails "not several"
  -- the value of the likelihood: Σ ln f
  local r = lsq(A, y, { noise = laplace(2) })
  expect(r.log_likelihood):near(-5 * math.log(4) - (0 + 2 + 1 + 47 + 2) / 2, 1e-9)

  local d = iddata { u = { 1, -1, 2, 0, -2, 1, 3, -1 }, y = { 1.2, -.1, 1.9, .4, -2.1, -.2, 2.6, .5 } }
  local Y, U_ = func "y", func "u"
  local a, b = params "a b"
  local p = predictor(-a * Y(t - 1) + b * U_(t))
  expect(p:fit(d, { ic = "zero", noise = uniform(-1, 1) }).volume):equals(arx(d,
    { na = 1, nb = 1, nk = 0, ic = "zero", noise = uniform(-1, 1) }).volume)
  for _, noise in ipairs { laplace(), gaussian(0.3), density(function(e) return exp(-e^4) end) } do
    local f, m = p:fit(d, { ic = "zero", noise = noise }),
      arx(d, { na = 1, nb = 1, nk = 0, ic = "zero", noise = noise })
    expect(f.theta):near(m.theta, 1e-9)
    expect(f.std):near(m.std, 1e-9)
    expect(f.log_likelihood):near(m.log_likelihood, 1e-9)
  end
  local yhat = func "yhat"
  expect(function() predictor(a * yhat(t - 1) + b * U_(t)):fit(d,
    { noise = laplace() }) end):fails "linear in its parameters"
end)

test("a density with a kink is least absolute deviations", function()
  local s = 7
  local function r() s = (1103515245 * s + 12345) % 2147483648 return s / 1073741824 - 1 end
  local A, y = {}, {}
  for i = 1, 60 do A[i] = { r(), r(), 1 } y[i] = A[i][1] - 2 * A[i][2] + 0.5 + r()^5 end
  local f, l = lsq(A, y, { noise = density(function(e) return exp(-abs(e)/0.3) end) }),
    lsq(A, y, { noise = laplace(0.3) })
  expect(f.theta):near(l.theta, 1e-8)
  expect(f.std):near(l.std, 1e-6)
end)

test("maximum likelihood of models that are not linear in θ", function()
  local s = 17
  local function r() s = (1103515245 * s + 12345) % 2147483648 return s / 1073741824 - 1 end
  local u, y, w = {}, {}, {}
  for t = 1, 400 do
    u[t] = r()
    w[t] = 1.5 * (w[t-1] or 0) - 0.7 * (w[t-2] or 0) + (u[t-1] or 0) + 0.5 * (u[t-2] or 0)
    y[t] = w[t] + 0.02 * r() + (t % 20 == 0 and 3 * r() or 0)          -- now and then an outlier
  end
  local d = iddata { y = y, u = u }
  local function off(m) return norm(m.theta - vec { 1, 0.5, -1.5, 0.7 }) end
  local squares, absolute = oe(d, { nb = 2, nf = 2 }), oe(d, { nb = 2, nf = 2, noise = laplace() })
  expect(off(absolute) < off(squares) / 5):is_true()                   -- robust: the outliers hardly count
  expect(absolute.log_likelihood > -400 * math.log(2 * math.exp(1) * 0.2)):is_true()
  -- no other θ nearby is more likely
  local function cost(theta)
    local m = oe(d, { nb = 2, nf = 2, start = theta, iterations = 0, ic = "zero" })
    local sum = 0
    local e = m:residuals(d, { init = "zero" })
    for t = 1, e.rows do sum = sum + math.abs(e[t]) end
    return sum
  end
  local best = oe(d, { nb = 2, nf = 2, noise = laplace(), ic = "zero" })
  local at = cost(best.theta)
  for i = 1, 4 do
    for _, h in ipairs { 1e-4, -1e-4 } do
      local moved = {}
      for j = 1, 4 do moved[j] = best.theta[j] + (i == j and h or 0) end
      expect(cost(moved) > at):is_true()
    end
  end
  expect(oe(d, { nb = 2, nf = 2, noise = gaussian() }).theta):near(squares.theta, 1e-12)
  local student = oe(d, { nb = 2, nf = 2, noise = density(function(e) return 1 / (1 + (e / 0.02)^2)^2 end) })
  expect(off(student) < off(squares) / 5):is_true()
  expect(armax(d, { na = 2, nb = 2, nc = 2, noise = laplace() }).rank):equals(6)
  expect(function() oe(d, { nb = 2, nf = 2, noise = uniform(-1, 1) }) end):fails "linear in θ"
end)

test("volumes in twelve dimensions", function()
  for _, d in ipairs { 5, 9, 12 } do
    seed(d)
    local A, y = randn(d, d), {}
    for i = 1, d do y[i] = i end
    local rows = {}
    for i = 1, d do
      rows[i] = {}
      for j = 1, d do rows[i][j] = A(i, j) * (j == 2 and 1e9 or 1) end
    end
    local s = lsq(rows, y, { noise = uniform(-1, 2) })           -- a parallelepiped
    expect(s.vertices.rows):equals(2^d)
    expect(s.volume * math.abs(det(mat(rows))) / 3^d):near(1, 1e-9)
  end
end)

test("a polytope that is no box, by two ways", function()
  seed(6)
  local e, u, y = rand(60), {}, {}
  for t = 1, 60 do u[t] = math.sin(t * t * 1.7) end
  for t = 1, 60 do
    y[t] = 0.2 * (e[t] - 0.5)
    for k = 1, 12 do y[t] = y[t] + 0.8^k * (u[t - k] or 0) end
  end
  local s = fir(iddata { y = y, u = u }, { nb = 12, noise = uniform(-0.1, 0.1) })
  expect(s.volume / 1.0136022412523e-23):near(1, 1e-9)
  expect(function() fir(iddata { y = y, u = u }, { nb = 15, noise = uniform(-0.1, 0.1) }) end)
    :fails "200000 vertices"
end)

test("an empty set with a parameter that no row contains", function()
  local d = iddata { y = { 5, -5, 5 }, u = { 0, 0, 0 }, Ts = 1 }
  local m = arx(d, { na = 1, nb = 1, nk = 0, noise = uniform(-1, 1), ic = "zero" })
  expect(m.feasible):equals(false)
  local words = tostring(m)
  expect(words):matches "|e| ≤ 5 instead of 1"             -- y(1) has no regressor
  expect(words):matches "b0 = 0\n"
  expect(words):matches "b0 is not identifiable"
end)
