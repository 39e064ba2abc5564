-- How one comes by a value of each type: { variable, statements that leave the value in it }. help and the
-- manual show fields and printing of the type by it, and the doctest reads every field of it.

local decay = 'x, k = var "x", param("k", 1)\ndecay = dae{ der(x) ~ -k*x }\n'
local recording = [[
u, y = prbs(31), {}
for i = 1, 31 do y[i] = 0.5*(y[i-1] or 0) + (i > 1 and u[i-1] or 0) + ((7*i) % 5)/50 end
d = iddata{ y = y, u = u, Ts = 0.1 }
]]
local measured = decay .. [[
d = iddata{ y = { 2.02, 1.49, 1.09, 0.83, 0.59, 0.46 }, Ts = 1 }
r = fit(decay, { params = { k }, data = d, y = x, start = { x = 2 } })
]]
local function runs(design)
  return decay .. 's = sweep(decay, { start = { x = 1 }, to = 1, times = {0, 0.5, 1},\n'
    .. '  params = { k = normal(1, 0.1) }, runs = 64, design = "' .. design .. '" })\n'
end
local pendulum = [[
x, y, z = vars "x y z"
pend = dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
]]

return {
  -- expressions
  expr = { "e", 'e = param("m", 2, { unit = "kg", text = "mass" })' },
  matrix = { "A", 'x = var "x"\nA = mat{{1, x}, {0, 1}}' },
  equation = { "eq", 'x = var "x"\neq = der(x) ~ -2*x' },
  func = { "g", 'g = func("g", 1)' },
  fn = { "f", 'x, y = vars "x y"\nf = fn({ x, y }, x + 2*y)' },
  eigenvalues = { "v", "v = eig{{0, 1}, {-2, -3}}" },
  complex = { "z", "z = complex(3, 4)" },
  -- models
  model = { "sys", [[
q, m, g, L = var("q", 2), params "m=1 g=9.81 L=1"
sys = lagrange{ q = q, T = m/2*q.dot.T*q.dot, V = m*g*q[2], C = { (q.T*q - L^2)/2 } }]] },
  matrix_form = { "form", 'q = var "q"\nform = lagrange{ q = q, T = q.dot^2, V = 3*q^2 }.matrix_form' },
  constraints = { "c", pendulum .. "c = pend:constraints()" },
  trace = { "tr", 'x, z = vars "x z"\ntr = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce("acc"):trace()' },
  structure = { "s", pendulum .. "s = pend:structure()" },
  pencil = { "p", [[
x, u = var("x", 3), input "u"
p = dae{ mat{{1, 1, 0}, {0, 0, 1}, {1, 1, 1}}*der(x) ~ x + vec{0, 0, u} }:pencil()]] },
  start = { "at", pendulum .. "at = pend:init{ fix = { x = 0.6, [x.dot] = 0 }, guess = { y = -0.8 } }" },
  -- runs
  solution = { "sol", decay .. "sol = decay:integrate{ start = { x = 1 }, to = 2 }" },
  stats = { "st", decay .. "st = decay:integrate{ start = { x = 1 }, to = 2 }:stats()" },
  drift = { "d", [[
x, z = vars "x z"
low = dae{ der(x) ~ z, 0 ~ x - sin(t) }:reduce "acc"
d = low:integrate{ start = { x = 0 }, to = 5 }:drift()]] },
  check = { "c", decay .. "c = decay:integrate{ start = { x = 1 }, to = 2 }:check()" },
  convergence = { "c", decay .. [[
c = converge(decay, { start = { x = 1 }, to = 2, methods = { rk.rk4 }, dt = { 0.2, 0.1, 0.05 },
  exact = exp(-t) })]] },
  newton = { "k", 'x = var "x"\nk = newton{ r = x^2 - 2, x = x, start = 3 }' },
  gauss_newton = { "g", [[
a, b = vars "a b"
g = gauss_newton{ R = { a - 1, a + b - 2.1, a + 2*b - 2.9 }, x = { a, b }, start = { 0, 0 } }]] },
  basins = { "b", [[
x, y = vars "x y"
k = newton{ r = { x^2 - y, y - 1 }, x = { x, y }, start = { 1, 1 } }
b = k:basins{ x = { -2, 2 }, y = { -2, 2 }, n = 5 }]] },
  -- methods
  tableau = { "tab", "tab = rk.bogacki_shampine" },
  conditions = { "c", "c = rk.rk4:conditions(4)" },
  stability_function = { "R", "R = rk.radau(2):stability()" },
  rosenbrock = { "m", "m = rosenbrock.ros2" },
  multistep = { "m", "m = bdf(2)" },
  -- many runs
  sweep = { "s", runs "latin hypercube" },
  sweep_stats = { "st", runs "latin hypercube" .. "st = s:stats()" },
  probability = { "p", runs "monte carlo" .. "p = s:probability(lt(x, 0.4))" },
  sobol_indices = { "i", runs "saltelli" .. "i = s:sobol(x, { bootstrap = 20 })" },
  morris_effects = { "m", runs "morris" .. "m = s:morris(x)" },
  chaos = { "c", runs "halton" .. "c = s:chaos(x, { degree = 2 })" },
  reliability_result = { "r", decay .. [[
r = reliability(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) },
  limit_state = x - 0.3, runs = 200 })]] },
  distribution = { "n", "n = normal(2, 0.5)" },
  joint_distribution = { "n", "n = normal({ 1, 2 }, {{0.04, 0.01}, {0.01, 0.09}})" },
  joint_component = { "c", "n = normal({ 1, 2 }, {{0.04, 0.01}, {0.01, 0.09}})\nc = n[2]" },
  random_process = { "w", "w = random_process{ band = { 0.1, 5 }, std = 2 }" },
  slurm = { "on", 'on = slurm{ partition = "short" }' },
  -- linear systems
  lti = { "G", "G = ss({{0, 1}, {-2, -3}}, {0, 1}, {1, 0})" },
  ["delay system"] = { "G", "G = delayed(tf({1}, {1, 1}), 2)" },
  roots = { "p", "p = tf({1}, {1, 3, 2}):poles()" },
  lti_stability = { "v", "v = tf({1}, {1, 3, 2, 1}):stability()" },
  damping = { "d", "d = tf({1}, {1, 2, 4}):damp()" },
  reachability = { "r", "r = ss({{-1, 0}, {0, -2}}, {1, 0}, {1, 1}):controllability()" },
  kalman_result = { "r",
    "r = kalman_filter(ss({{1}}, {0}, {1}, {0}, 1), 0, 1, { y = {1, 3, 2}, P0 = 9 })" },
  margins = { "m", "m = tf({2}, {1, 2, 1, 0}):margin()" },
  response = { "r", "r = tf({4}, {1, 2, 4}):step{ 0, 1, 2, 3 }" },
  ["frequency response"] = { "r", "r = tf({1}, {1, 1}):bode{ 0.1, 1, 10 }" },
  spectrum = { "s", "s = periodogram(prbs(7))" },
  surface = { "s", "s = surface(function(x, y) return x*y end, { -1, 1 }, { -1, 1 }, 3)" },
  figure = { "fig", 'fig = plot({ 0, 1, 4, 9 }, { title = "Squares" })' },
  -- identification
  iddata = { "d", 'd = iddata{ y = { 0, 2, 1, 4 }, u = { 1, 0.5, 2, 1 }, Ts = 0.1 }' },
  idmodel = { "mod", recording .. "mod = arx(d, { na = 1, nb = 1, nk = 1 })" },
  validation = { "v", recording .. "v = arx(d, { na = 1, nb = 1, nk = 1 }):validate(d)" },
  validations = { "v", [[
u, y = {}, {{}, {}}
for t = 1, 40 do u[t] = (-1)^(t*t//3) for i = 1, 2 do y[i][t] = i/3*(y[i][t-1] or 0) + (u[t-1] or 0) end end
d = iddata{ y = y, u = u }
v = arx(d, { na = {{1, 0}, {0, 1}}, nb = 1 }):validate(d)]] },
  order_scan_result = { "s", recording .. "s = order_scan(d, d, { na = {1, 2}, nb = {1, 2}, nk = {1, 1} })" },
  comparison = { "c", recording
    .. "c = compare(d, { arx = arx(d, { na = 1, nb = 1 }), fir = fir(d, { nb = 3 }) })" },
  nlsq_result = { "r", "r = nlsq(function(p) return { p[1] - 1, p[1]*p[2] - 6, p[2] - 5.9 } end, { 1, 1 })" },
  lsq_result = { "r", "r = lsq({ {1, 0}, {1, 1}, {1, 2} }, { 1, 2, 4 })" },
  parameter_set = { "s", "s = lsq({ {1, 0}, {1, 1}, {1, 2} }, { 1, 2, 4 }, { noise = uniform(-1, 1) })" },
  density = { "p", "p = density(function(e) return 1/(1 + e^2)^2 end)" },
  idpoly = { "m", "m = idpoly{ A = { 1, -0.5 }, B = { 0, 1 } }" },
  predictor = { "p", 'a1, b1 = params "a1 b1"\np = idpoly{ A = { 1, a1 }, B = { 0, b1 } }:predictor()' },
  predictor_fit = { "f", [[
y, u, a, b = func "y", func "u", params "a b"
d = iddata{ y = { 0, 1, 0.6, 1.2, 0.7 }, u = { 1, 0, 1, 0, 1 } }
f = predictor(a*y(t-1) + b*u(t-1)):fit(d)]] },
  fit_result = { "r", measured },
  profile_result = { "p", measured .. "p = r:profile(k, { points = 5 })" },
  bootstrap_result = { "b", measured .. "b = r:bootstrap{ runs = 10 }" },
  cross_validation = { "c", measured .. "c = r:cross_validate{ folds = 3 }" },
  starts_result = { "s", measured .. "s = r:starts{ runs = 3 }" },
}
