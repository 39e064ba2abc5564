-- What sweeps say: indices against exact values, polynomials recovered, probabilities, tables.
y, x = vars "y x"
a, b, c, k = params "a=0 b=0 c=0 k=1"
decay = dae { der(x) ~ -k*x }

-- The value of an expression in parameters, as the end of y′ = f.
local function sampled(f, options)
  options.start, options.to = { y = 0 }, 1
  return sweep(dae { der(y) ~ f }, options)
end

local ishigami = sin(a) + 7*sin(b)^2 + c^4*sin(a)/10
local box = { a = uniform(-math.pi, math.pi), b = uniform(-math.pi, math.pi), c = uniform(-math.pi, math.pi) }

-- Ishigami & Homma, 1990, with A = 7, B = 0.1.
local B, V1 = 0.1, 0.5*(1 + 0.1*math.pi^4/5)^2
local V2, V13 = 49/8, B^2*math.pi^8*(1/18 - 1/50)
local V = V1 + V2 + V13

test("Sobol' indices of Ishigami's function lie in their intervals", function()
  local s = sampled(ishigami, { params = box, runs = 2048, design = "saltelli", seed = 1 }):sobol(y)
  local first, total = { V1/V, V2/V, 0 }, { (V1 + V13)/V, V2/V, V13/V }
  for j = 1, 3 do
    expect(s.first[j]):near(first[j], 0.04)
    expect(s.total[j]):near(total[j], 0.04)
    expect(s.first_interval[j][1] <= first[j] + 0.02
      and first[j] - 0.02 <= s.first_interval[j][2]):equals(true)
    expect(s.total_interval[j][1] < s.total_interval[j][2]):equals(true)
  end
end)

test("Sobol' indices of the g-function", function()
  local weights, factors = { 0, 1, 4.5 }, {}
  local variance, shares = 1, {}
  for j, w in ipairs(weights) do
    factors[j] = (abs(4*({ a, b, c })[j] - 2) + w)/(1 + w)
    shares[j] = 1/(3*(1 + w)^2)
    variance = variance*(1 + shares[j])
  end
  local g = factors[1]*factors[2]*factors[3]
  local unit = { a = uniform(0, 1), b = uniform(0, 1), c = uniform(0, 1) }
  local s = sampled(g, { params = unit, runs = 1024, design = "saltelli", seed = 2 }):sobol(y,
    { bootstrap = 50 })
  for j = 1, 3 do
    expect(s.first[j]):near(shares[j]/(variance - 1), 0.03)
    expect(s.total[j]):near(shares[j]*(variance/(1 + shares[j]))/(variance - 1), 0.03)
  end
end)

test("Morris: effects of a linear function are its slopes, a product has a deviation", function()
  local linear = sampled(2*a - 3*b, { runs = 10, design = "morris",
    params = { a = uniform(0, 1), b = uniform(0, 2) } }):morris(y)
  expect(linear.mu):near({ 2, -6 }, 1e-5)
  expect(linear.mu_star):near({ 2, 6 }, 1e-5)
  expect(linear.sigma):near({ 0, 0 }, 1e-5)
  local mixed = sampled(a*b, { params = { a = uniform(-1, 1), b = uniform(-1, 1) }, runs = 20,
    design = "morris" }):morris(y)
  expect(mixed.sigma[1] > 0.5):equals(true)
end)

test("polynomial chaos is exact on polynomials, whatever the distributions", function()
  local f = 2 + a - 3*a*b + b^2*c
  local params = { a = uniform(-1, 2), b = normal(1, 0.5), c = beta(2, 3, 0, 2) }
  local s = sampled(f, { params = params, runs = 100, design = "sobol", seed = 5, rtol = 1e-12,
    atol = 1e-13 })
  local p = s:chaos(y, { degree = 3 })
  expect(p.loo < 1e-12):equals(true)
  local Eb2 = 1 + 0.25
  expect(p.mean):near(2 + 0.5 - 3*0.5 + Eb2*0.8, 1e-6)
  expect(p { a = 0.3, b = -1, c = 1.5 }):near(evaluate(f, { a = 0.3, b = -1, c = 1.5 }), 1e-6)
  for _, d in ipairs { triangular(0, 1, 3), lognormal(0, 0.3), exponential(2), normal(2, 1) } do
    local one = sampled(a^3 - 2*a, { params = { a = d }, runs = 40, design = "sobol", rtol = 1e-12,
      atol = 1e-13 })
    local q = one:chaos(y, { degree = 4 })
    expect(q { a = 1.7 }):near(1.7^3 - 3.4, 1e-6)
    expect(q.loo < 1e-10):equals(true)
  end
end)

test("polynomial chaos of Ishigami's function", function()
  local s = sampled(ishigami, { params = box, runs = 500, design = "sobol", rtol = 1e-10, atol = 1e-12 })
  local p = s:chaos(y, { degree = 9 })
  expect(p.loo < 0.01):equals(true)
  local i = p:sobol()
  expect(i.first):near({ V1/V, V2/V, 0 }, 0.01)
  expect(i.total):near({ (V1 + V13)/V, V2/V, V13/V }, 0.01)
end)

test("a small probability by subset simulation", function()
  for limit, exact in pairs { [0.3] = 1 - normal(1, 0.1):cdf(-math.log(0.3)),
    [0.25] = 1 - normal(1, 0.1):cdf(-math.log(0.25)) } do
    local r = reliability(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) },
      limit_state = x - limit, runs = 2000, seed = 1, rtol = 1e-8 })
    expect(r.p/exact):near(1, 0.35)
  end
  -- The coefficient of variation against that of repetitions (16 of them tell it to about 40 %).
  local sum, squares, reported, n = 0, 0, 0, 16
  for seed = 1, n do
    local one = reliability(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) },
      limit_state = x - 0.27, runs = 300, rtol = 1e-6, seed = seed })
    sum, squares, reported = sum + one.p, squares + one.p^2, reported + one.cov/n
  end
  local exact = 1 - normal(1, 0.1):cdf(-math.log(0.27))
  expect(sum/n/exact):near(1, 2*reported/math.sqrt(n))
  expect(math.sqrt(squares/n - (sum/n)^2)/(sum/n)/reported):near(1, 0.4)
  expect(function() reliability(decay, { start = { x = 1 }, to = 1, params = { k = { 1, 2 } },
    limit_state = x }) end)
    :fails "no distribution"
  expect(function() reliability(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) } }) end)
    :fails "limit_state"
end)

test("quantiles, probabilities, pictures", function()
  local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = uniform(1, 2) }, runs = 1024,
    design = "sobol" })
  expect(s:quantile(x, 0.5)):near(math.exp(-1.5), 1e-3)
  expect(s:quantile(x, { 0.1, 0.9 }, 0.5)):near({ math.exp(-0.95), math.exp(-0.55) }, 1e-3)
  local p = s:probability(lt(x, math.exp(-1.25)))
  expect(p.p):near(0.75, 0.002)
  expect(p.low < 0.75 and 0.75 < p.high):equals(true)
  expect(s:probability(lt(x, 10), { method = "clopper-pearson" }).high):equals(1)
  for _, figure in ipairs { s:histogram(x), s:density(x, { t = 0.5 }), s:fan(x), s:scatter { x, x^2 },
    s:convergence(x) } do
    expect(tostring(figure)):matches "figure"
  end
  expect(s:probability(all(lt(x, math.exp(-1.25)), gt(x, math.exp(-1.75))), 1).p):near(0.5, 0.002)
  expect(function() s:probability(x) end):fails "is not a condition"
  expect(function() s:sobol(x) end):fails 'design = "saltelli"'
  expect(function() s:morris(x) end):fails 'design = "morris"'
  expect(function() s:fan(x, 0.7) end):fails "0.7"
  expect(tostring(s:fan(x, { title = "Decay" }))):equals(tostring(s:fan(x)):gsub("figure", "figure 'Decay'"))
  expect(tostring(s:fan(x, { 0.1, title = "Decay" }))):matches "2 series"
  expect(tostring(s:histogram(x, { title = "Ends", bins = 3 }))):matches "figure 'Ends'"
  expect(s:density(x, { xlabel = "x(1)" }):svg()):matches "x%(1%)"
  expect(function() s:fan(x, { titel = "Decay" }) end):fails "Did you mean 'title'"
  expect(function() s:histogram(x, { colour = "red" }) end):fails "unknown option 'colour'"
end)

test("tables, and the call that makes a failed run again", function()
  local pole = dae { der(x) ~ k*x^2 }
  local s = sweep(pole, { start = { x = 1 }, to = 1, params = { k = { 0.5, 2 } } })
  expect(#s.failures):equals(1)
  expect(s.failures[1].call):equals "s[2]"
  expect(s[2].status):equals(s.failures[1].why)
  local name = os.tmpname()
  s:csv(name)
  local file = io.open(name)
  expect(file:read "l"):equals "run,k,x,failure"
  expect(file:read "l"):matches "1,0.5,[12]%."
  expect(file:read "l"):matches "2,2,,"
  file:close()
  s:json(name)
  file = io.open(name)
  local text = file:read "a"
  file:close()
  os.remove(name)
  expect(text):matches '"k": 0.5'
  expect(text):matches '"x": null, "failure": "'
end)
