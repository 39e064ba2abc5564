-- Which method integrate{} takes when none is named, counted in steps and evaluations, and the short roads to
-- a start.

local x, y = vars "x y"

local function taken(model, options)
  local sol = model:integrate(options)
  expect(sol.status):equals "finished"
  return sol:stats(), sol
end

test("what swings is not taken for stiff: pairs ±λ and ±iω", function()
  -- A chain of five links at rest in its angles: ∂x′/∂x has eigenvalues ±λ only.
  local th = var("th", 5)
  local px, py, T, V = 0, 0, 0, 0
  for i = 1, 5 do
    px, py = px + sin(th[i]), py - cos(th[i])
    local v = der(vec { px, py })
    T, V = T + v.T*v/2, V + 9.81*py
  end
  local chain = lagrange { q = th, T = T, V = V }
  local rest = { [th] = { 1, 1, 1, 1, 1 }, [th.dot] = { 0, 0, 0, 0, 0 } }
  expect(taken(chain, { start = rest, to = 5 }).method):equals "verner87"
  -- Arenstorf's orbit begins where one direction grows as fast as another decays.
  local u, v = vars "u v"
  local mu = 0.012277471
  local D1, D2 = ((x + mu)^2 + y^2)^(3/2), ((x - (1 - mu))^2 + y^2)^(3/2)
  local orbit = dae { der(x) ~ u, der(y) ~ v, der(u) ~ x + 2*v - (1 - mu)*(x + mu)/D1 - mu*(x - (1 - mu))/D2,
    der(v) ~ y - 2*u - (1 - mu)*y/D1 - mu*y/D2 }
  local start = { x = 0.994, y = 0, u = 0, v = -2.00158510637908252240537862224 }
  expect(taken(orbit, { start = start, to = 17 }).method):equals "verner87"
end)

test("a hanging chain in Cartesian coordinates is integrated explicitly", function()
  local N = 20
  local px, py = var("px", N), var("py", N)
  local q, C, V, start = vstack(px, py), {}, 0, {}
  local x0, y0, zero = {}, {}, {}
  for i = 1, N do
    local dx, dy = i > 1 and px[i] - px[i - 1] or px[1], i > 1 and py[i] - py[i - 1] or py[1]
    C[i], V = (dx^2 + dy^2 - 1/N^2)/2, V + 9.81/N*py[i]
    x0[i], y0[i], zero[i] = i/N*math.sqrt(0.5), -i/N*math.sqrt(0.5), 0
  end
  local model = lagrange { q = q, T = q.dot.T*q.dot/(2*N), V = V, C = C }:reduce()
  local stats = taken(model, { start = { [px] = x0, [py] = y0, [px.dot] = zero, [py.dot] = zero }, to = 1 })
  expect(stats.method):equals "verner87"
  expect(stats.jacobians):equals(0)
end)

--- uᵢ′ = N²(uᵢ₋₁ - 2uᵢ + uᵢ₊₁) on 0 < x < 1
local function heat(N)
  local u, equations, start = var("u", N), {}, {}
  for i = 1, N do
    equations[i] = der(u[i]) ~ (N + 1)^2*((i > 1 and u[i - 1] or 0) - 2*u[i] + (i < N and u[i + 1] or 0))
    start[i] = math.sin(math.pi*i/(N + 1))
  end
  return dae(equations), { [u] = start }, u
end

test("with many unknowns an implicit step has to save more explicit ones", function()
  local model, start, u = heat(80)                       -- λT = 4·81²·T
  local short, sol = taken(model, { start = start, to = 0.02, rtol = 1e-6 })
  expect(short.method):equals "dop853"                   -- of the pairs it is stable for least work
  expect(sol(u[40], 0.02)):near(sol(u[40], 0)*exp(-4*81^2*math.sin(math.pi/162)^2*0.02), 1e-6)
  -- some 330 steps at the edge of stability: fewer than an implicit method is worth
  expect(taken(model, { start = start, to = 0.05, rtol = 1e-8 }).method):equals "dop853"
  expect(taken(model, { start = start, to = 0.5, rtol = 1e-6 }).method):equals "radau"
  local few, few_start = heat(4)                         -- λT = 90·T; both take as long for T = 6
  expect(taken(few, { start = few_start, to = 4, rtol = 1e-6 }).method):equals "verner87"
  expect(taken(few, { start = few_start, to = 8, rtol = 1e-6 }).method):equals "radau"
  expect(taken(few, { start = few_start, to = 4, rtol = 1e-4 }).method):equals "rodas5p"
end)

test("the work of steps is counted on large models: the same equations, other sizes and tolerances", function()
  --- uᵢ′ = D (uᵢ₋₁ - 2uᵢ + uᵢ₊₁) + c (uᵢ² - uᵢ₊₁²), D = 0.003 (N + 1)²
  local function burgers(N, to, rtol)
    local u, equations, start = var("u", N), {}, {}
    for i = 1, N do
      local l, r, s = i > 1 and u[i - 1] or 0, i < N and u[i + 1] or 0, i/(N + 1)
      equations[i] = der(u[i]) ~ -(r^2 - l^2)*(N + 1)/4 + 0.003*(N + 1)^2*(l - 2*u[i] + r)
      start[i] = 1.5*s*(1 - s)^2
    end
    return taken(dae(equations), { start = { [u] = start }, to = to, rtol = rtol })
  end
  expect(burgers(200, 2.5, 1e-4).method):equals "rodas4"      -- of 206 explicit steps, each 1/6 of such a one
  expect(burgers(200, 5, 1e-6).method):equals "radau"         -- 412, each 1/18
  expect(burgers(200, 2.5, 1e-10).method):equals "dop853"     -- where radau makes some 50 steps
  expect(burgers(100, 2.5, 1e-6).method):equals "dop853"      -- a quarter of the steps
  expect(burgers(200, 25, 1e-10).method):equals "radau"
end)

--- Convection and diffusion on n × n points; more(i, j): what is added to u′
local function wind(n, more)
  local u, equations, start = var("u", n*n), {}, {}
  local function at(i, j) return i >= 1 and i <= n and j >= 1 and j <= n and u[(i - 1)*n + j] or 0 end
  for i = 1, n do
    for j = 1, n do
      local l, r = at(i, j - 1), at(i, j + 1)
      equations[#equations + 1] = der(at(i, j)) ~ (n + 1)^2*(at(i - 1, j) + at(i + 1, j) + l + r - 4*at(i, j))
        - 5*(n + 1)*(r - l) + more(i, j)
      start[#start + 1] = math.sin(math.pi*i/(n + 1))*math.sin(math.pi*j/(n + 1))
    end
  end
  return dae(equations), { [u] = start }, u[n*n//2]
end

test("wide separators: bdf for few digits, which factorises seldom, where t spoils the order of rodas4", function()
  local driven, start, u = wind(15, function(i) return i == 1 and sin(t) or 0 end)
  local stats, sol = taken(driven, { start = start, to = 10, rtol = 1e-4, atol = 1e-6 })
  expect(stats.method):equals "bdf"
  expect(3*stats.factorisations < stats.steps):is_true()  -- rodas4: one a step
  local exact = driven:integrate { start = start, to = 10, rtol = 1e-10, atol = 1e-12, method = "radau" }
  expect(math.abs(sol(u, 10) - exact(u, 10)) < 1e-5):is_true()
  expect(taken(driven, { start = start, to = 10, rtol = 1e-6 }).method):equals "radau"
  local alone, rest = wind(15, function() return 0 end)
  expect(taken(alone, { start = rest, to = 10, rtol = 1e-4 }).method):equals "rodas4"
end)

test("a step on a grid costs an explicit method some 1/50 of what it costs Radau IIA", function()
  local model, start = wind(20, function() return 0 end)      -- 295 explicit steps
  local stats = taken(model, { start = start, to = 0.5, rtol = 1e-6 })
  expect(stats.method):equals "dop853"
  expect(stats.jacobians):equals(0)
end)

test("functions count in the work of an explicit step, powers with numbers as products", function()
  local function chain(f)
    local N = 200
    local u, equations, start = var("u", N), {}, {}
    for i = 1, N do
      local l, r = u[math.max(i - 1, 1)], u[math.min(i + 1, N)]
      equations[i] = der(u[i]) ~ 80*(l - 2*u[i] + r) + f(u[i])
      start[i] = math.cos(math.pi*i/N)
    end
    return taken(dae(equations), { start = { [u] = start }, to = 5, rtol = 1e-6 }).method
  end
  expect(chain(function(u) return -u^3 end)):equals "dop853"
  expect(chain(function(u) return -sinh(u) - exp(u)*sin(u) end)):equals "radau"
end)

test("modes of a large model that are fast and at rest are not followed; those that move are", function()
  -- masses in a row, springs of stiffness 10⁶; moved as a whole, or each on its own
  local N = 40
  local q, v, equations = var("q", N), var("v", N), {}
  for i = 1, N do
    local l, r = q[i > 1 and i - 1 or i], q[i < N and i + 1 or i]
    equations[#equations + 1] = der(q[i]) ~ v[i]
    equations[#equations + 1] = der(v[i]) ~ 1e6*(l - 2*q[i] + r) - q[i]
  end
  local model, still, struck = dae(equations), {}, {}
  for i = 1, N do still[i], struck[i] = 1, i % 2 end
  local zero = {}
  for i = 1, N do zero[i] = 0 end
  local calm, sol = taken(model, { start = { [q] = still, [v] = zero }, to = 10, rtol = 1e-6 })
  expect(calm.method):equals "radau"
  expect(calm.steps < 100):is_true()                     -- an explicit pair: 10·2000/6
  expect(sol(q[7], 10)):near(math.cos(10), 1e-4)
  local wild = taken(model, { start = { [q] = struck, [v] = zero }, to = 10, rtol = 1e-6 })
  expect(wild.method):matches "^radau, then verner87"
end)

test("stiff models at loose tolerances go to a Rosenbrock method, at tight ones to radau", function()
  local model = dae { der(x) ~ y, der(y) ~ 1e3*(1 - x^2)*y - x }
  local driven = dae { der(x) ~ y, der(y) ~ 1e3*(1 - x^2)*y - x + sin(t) }
  local function method(sys, rtol) return taken(sys,
    { start = { x = 2, y = 0 }, to = 100, rtol = rtol }).method end
  expect(method(model, 1e-4)):equals "rodas5p"
  expect(method(model, 1e-6)):equals "radau"
  expect(method(driven, 1e-4)):equals "rodas5p"
  local large, start = heat(600)
  expect(taken(large, { start = start, to = 0.1, rtol = 1e-4 }).method):equals "rodas4"
  for _, rtol in ipairs { 1e-5, 1e-6 } do
    expect(taken(large, { start = start, to = 0.1, rtol = rtol }).method):equals "radau"
  end
end)

test("stiffness is noticed well inside the stability region, where a tight tolerance keeps the steps",
  function()
  local c, T, r = vars "c T r"
  local reactor = dae { der(c) ~ 0.1*(1 - c) - r, der(T) ~ 0.1*(1 - T) + 0.5*r - 0.05*(T - 0.8),
    0 ~ r - 1e8*c*exp(-18/T) }
  local stats, sol = taken(reactor, { start = { c = 0.5, T = 1 }, to = 200, rtol = 1e-10, atol = 1e-13 })
  expect(stats.method):equals "verner98, then radau"
  expect(stats.steps < 150):is_true()                    -- 807 before
  local check = reactor:integrate { start = { c = 0.5, T = 1 }, to = 200, rtol = 1e-12, atol = 1e-14,
    method = "radau" }
  expect(sol(c, 200)):near(check(c, 200), 1e-9)
  -- An oscillation that is followed is not stiff, however long it lasts.
  expect(taken(dae { der(x) ~ y, der(y) ~ -x }, { start = { x = 1, y = 0 }, to = 1000,
    rtol = 1e-10 }).method):equals "verner98"
end)

test("a start that gives every state of x′ = f needs no system, and is the same", function()
  local u, start, equations = var("u", 30), {}, {}
  local k = input "k"
  local a = param("a", 2)
  for i = 1, 30 do
    equations[i] = der(u[i]) ~ -a*u[i]*u[i % 30 + 1] + k
    start[i] = 1/i
  end
  local model = dae(equations)
  local inputs = { [k] = t + 3 }
  local at = model:init { fix = { [u] = start }, inputs = inputs, params = { a = 5 }, from = 1 }
  expect(at(u[2])):equals(0.5)
  expect(at(u.dot[2])):near(-5*0.5/3 + 4, 1e-15)
  expect(at(a)):equals(5)
  expect(tostring(at:ledger())):matches "fixed"
  -- the long road: one value as a guess
  local some = {}
  for i = 1, 29 do some[u[i]] = start[i] end
  local slow = model:init { fix = some, guess = { [u[30]] = start[30] }, inputs = inputs, params = { a = 5 },
    from = 1 }
  for i = 1, 30 do expect(slow(u.dot[i])):near(at(u.dot[i]), 1e-14) end
  expect(function() model:init { fix = some, inputs = inputs } end):fails "u"
  expect(function() model:init { fix = { [u] = start } } end):fails "input 'k' has no value"
  start[7] = 0/0
  expect(function() model:init { fix = { [u] = start }, inputs = inputs } end):fails "u"
end)

test("starts of one model with other values do not share anything but the derivatives", function()
  local model, start, u = heat(30)
  local first = model:integrate { start = start, to = 0.1, rtol = 1e-8 }
  for i = 1, 30 do start[u][i] = 2*start[u][i] end
  local second = model:integrate { start = start, to = 0.1, rtol = 1e-8 }
  expect(second(u[15], 0.1)):near(2*first(u[15], 0.1), 1e-8)
end)
