-- Distributions in params and start of sweep.
x, v = vars "x v"
k, c, m = params "k=1 c=0.1 m=1"
decay = dae { der(x) ~ -k*x }
spring = dae { der(x) ~ v, m*der(v) ~ -k*x - c*v }

local function column(list)
  local numbers = {}
  for i = 1, #list do numbers[i] = list[i] end
  return numbers
end

test("a run's numbers do not depend on workers, lanes and how many runs there are", function()
  for _, design in ipairs { "monte carlo", "sobol", "halton" } do
    local function make(runs, workers, lanes)
      return sweep(spring, { start = { x = normal(1, 0.1), v = 0 }, to = 1, runs = runs, seed = 5,
        params = { k = lognormal(0, 0.2), m = uniform(1, 2) }, design = design, workers = workers,
        lanes = lanes })
    end
    local all, few = make(40), make(20, 1, 1)
    for _, name in ipairs { "k", "m", "x" } do
      expect(column(few.params[name])):equals({ table.unpack(column(all.params[name]), 1, 20) })
    end
    expect(all:final(x):slice(1, 20)):near(few:final(x), 1e-5)
  end
end)

test("seeds and designs give other numbers; the same seed the same", function()
  local function numbers(seed, design)
    return column(sweep(decay, { start = { x = 1 }, to = 0.1, runs = 5, seed = seed, design = design,
                                 params = { k = normal(2, 0.1) } }).params.k)
  end
  expect(numbers(1)):equals(numbers(1))
  expect(numbers(1)[1] ~= numbers(2)[1]):equals(true)
  expect(numbers(1)[1] ~= numbers(1, "sobol")[1]):equals(true)
end)

test("the mean of an exponential decay over a uniform rate", function()
  local exact = math.exp(-1) - math.exp(-2)                 -- ∫ e^{-k} dk from 1 to 2
  local errors = { ["monte carlo"] = 0.01, ["latin hypercube"] = 1e-4, sobol = 1e-5, halton = 1e-4 }
  for design, error in pairs(errors) do
    local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = uniform(1, 2) }, runs = 1024,
      seed = 1, design = design, rtol = 1e-9, atol = 1e-12 })
    expect(s:mean(x)):near(exact, error)
  end
end)

test("numbers that vary together, by component, by vector, by a fit", function()
  local joint = normal({ 2, 1 }, { { 0.04, -0.018 }, { -0.018, 0.01 } })
  local function correlation(s, a, b)
    local A, B, n = s.params[a], s.params[b], #s
    local ma, mb, saa, sbb, sab = 0, 0, 0, 0, 0
    for i = 1, n do ma, mb = ma + A[i]/n, mb + B[i]/n end
    for i = 1, n do
      saa, sbb, sab = saa + (A[i] - ma)^2, sbb + (B[i] - mb)^2, sab + (A[i] - ma)*(B[i] - mb)
    end
    return sab/math.sqrt(saa*sbb)
  end
  local s = sweep(spring, { start = { x = 1, v = 0 }, to = 0.1, runs = 2000, design = "sobol",
                            params = { k = joint[1], m = joint[2] } })
  expect(correlation(s, "k", "m")):near(-0.9, 0.01)
  local p = param("p", { 2, 1 })
  local both = dae { der(x) ~ -p[1]*x + p[2] }
  s = sweep(both, { start = { x = 1 }, to = 0.1, runs = 2000, design = "sobol", params = { p = joint } })
  expect(correlation(s, "p1", "p2")):near(-0.9, 0.01)

  local y = {}
  for i = 1, 41 do y[i] = 2*math.exp(-0.5*(i - 1)*0.1) + 0.01*math.sin(37*i) end
  local r = fit(decay, { params = { k, x }, data = iddata { y = y, Ts = 0.1 }, y = x })
  expect(#r.theta):equals(2)                                -- k and the start
  s = sweep(decay, { start = {}, to = 1, runs = 4096, design = "sobol", params = { r } })
  expect(correlation(s, "k", "x")):near(r.cov(1, 2)/math.sqrt(r.cov(1, 1)*r.cov(2, 2)), 0.02)
  expect(s:final(x)):near(s:final(x), 0)
  expect(s.params.k[1] ~= r.theta[1]):equals(true)
  local same = sweep(decay, { from = r, to = 1, runs = 4096, design = "sobol" })
  expect(same:final(x)):near(s:final(x), 0)
  for _, twice in ipairs { { params = { k = 0.5 } }, { start = { x = 1 } },
    { params = { k = normal(1, 2) } } } do
    twice.from, twice.to, twice.runs = r, 1, 8
    expect(function() sweep(decay, twice) end):fails "given twice"
  end
end)

test("densities of noise are distributions too", function()
  local s = sweep(decay, { start = { x = gaussian(0.1) }, to = 1, runs = 100,
    params = { k = exponential(2) } })
  expect(#s):equals(100)
  expect(function() sweep(decay, { start = { x = laplace(1) }, to = 1, runs = 3 }) end)
    :fails "cannot be drawn from"
  local data = iddata { y = { 1, 2, 3 }, u = { 1, 0, 0 } }
  expect(function() arx(data, { na = 1, nb = 1, noise = normal(0, 1) }) end):fails "gaussian(0.1)"
end)

test("grids, stars and lists beside distributions", function()
  local function make(design, levels)
    return sweep(decay, { start = { x = uniform(0, 1) }, to = 1, params = { k = uniform(1, 2) },
      design = design, levels = levels })
  end
  local s = make("grid", 3)
  expect(#s):equals(9)
  expect(s.params.k[4]):near(1.5, 1e-15)
  s = make "star"
  expect(#s):equals(5)
  expect(s.params.k[1]):near(1.5, 1e-15)
  s = sweep(decay, { start = { x = { 1, 2, 3 } }, to = 1, params = { k = uniform(1, 2) }, runs = 3 })
  expect(column(s.params.x)):equals { 1, 2, 3 }
end)

test("what is wrong is named", function()
  local function try(options)
    options.start, options.to = options.start or { x = 1 }, 1
    return function() sweep(decay, options) end
  end
  local d = normal(1, 0.1)
  expect(try { params = { k = d } }):fails "runs = 1000"
  expect(try { params = { k = d }, runs = 0 }):fails "runs = 0"
  expect(try { params = { k = d }, runs = 5, design = "sobl" }):fails "Did you mean 'sobol'?"
  expect(try { params = { k = d }, runs = 5, scramble = "own" }):fails "Did you mean 'owen'?"
  expect(try { params = { k = d }, runs = 5, design = "grid" }):fails "levels"
  expect(try { params = { k = d }, design = "grid", levels = 0 }):fails "levels = 5"
  expect(try { params = { k = { 1, 2 } }, runs = 5 }):fails "lists"
  expect(try { params = { k = d }, start = { x = { 1, 2 } }, runs = 5 }):fails "discrete{"
  expect(try { params = { k = d }, runs = 5, grid = true }):fails 'design = "grid"'
  expect(try { params = { k = d }, runs = 20000000 }):fails "10 000 000"
  expect(try { params = { k = normal({ 1, 2 }, { { 1, 0 }, { 0, 1 } }) }, runs = 5 }):fails "has 1 components"
  expect(try { params = { k = "normal" }, runs = 5 }):fails "k"
  expect(try { params = { iddata { y = { 1 } } }, runs = 5 }):fails "result of fit"
  expect(function() normal(1, 0) end):fails "sigma must be positive"
  expect(function() uniform(2, 1) end):fails "low must be below high"
  expect(function() triangular(0, 2, 1) end):fails "low ≤ mode ≤ high"
  expect(function() beta(-1, 1) end):fails "a must be positive"
  expect(function() discrete({ 1, 2 }, { 1 }) end):fails "1 weights"
  expect(function() empirical {} end):fails "no data"
  expect(function() normal({ 1, 2 }, { { 1, 2 }, { 2, 1 } }) end):fails "eigenvalue"
end)

test("rand, randn and seed", function()
  seed(3)
  local a, b = rand(4, 2), randn(1000)
  seed(3)
  expect(rand(4, 2)):equals(a)
  expect(#b):equals(1000)
  local _, p = ks_test(b, normal(0, 1))
  expect(p > 0.01):equals(true)
  _, p = ks_test(uniform(2, 5):sample(1000), uniform(2, 5))
  expect(p > 0.01):equals(true)
  expect(function() rand(-1) end):fails "-1 rows"
  expect(function() rand(1000000, 1000000) end):fails "100 000 000"
end)
