-- Large models: sparse choices of states, starts level by level, units of long chains.

local function chain(N)
  local x, y = var("x", N), var("y", N)
  local T, V, C = 0, 0, {}
  for i = 1, N do
    local dx, dy = x[i] - (i > 1 and x[i-1] or 0), y[i] - (i > 1 and y[i-1] or 0)
    C[i] = (dx^2 + dy^2 - 1/N^2)/2
    T = T + 1/(2*N)*(x[i].dot^2 + y[i].dot^2)
    V = V + 9.81/N*y[i]
  end
  return lagrange { q = vstack(x, y), T = T, V = V, C = C }, x, y
end

local function positions(N, x, y, digits)
  local at = {}
  for i = 1, N do
    local s = math.sqrt(0.5)*i/N
    local value = digits and tonumber(("%." .. digits .. "g"):format(s)) or s
    at[x[i]], at[y[i]] = value, -value
  end
  return at
end

local function at_rest(N, x, y, list)
  for i = 1, N do list[x[i].dot], list[y[i].dot] = 0, 0 end
  return list
end

test("a chain of 200 links starts from rounded positions, as a guess and as the nearest ones", function()
  local N = 200
  local sys, x, y = chain(N)
  local near = sys:init { fix = at_rest(N, x, y, {}), guess = positions(N, x, y, 4) }
  -- tells what moved, 20 lines
  local moved = sys:init { fix = at_rest(N, x, y, positions(N, x, y, 4)), nearest = true }
  for _, at in ipairs { near, moved } do
    for _, i in ipairs { 1, 77, N } do
      local dx, dy = at(x[i]) - (i > 1 and at(x[i-1]) or 0), at(y[i]) - (i > 1 and at(y[i-1]) or 0)
      expect(dx^2 + dy^2):near(1/N^2, 1e-12)
      expect(at(x[i])):near(math.sqrt(0.5)*i/N, 5e-4)
    end
  end
  local function distance(at)
    local sum = 0
    for key, value in pairs(positions(N, x, y, 4)) do sum = sum + (at(key) - value)^2 end
    return sum
  end
  expect(distance(moved) <= distance(near)*(1 + 1e-9)):is_true()
end)

test("dummy derivatives of 200 links agree with the projected form", function()
  local N = 200
  local sys, x, y = chain(N)
  local at = sys:init { fix = at_rest(N, x, y, positions(N, x, y)) }
  local low = sys:reduce("dummy", { at = at })
  local a = low:integrate { start = at, to = 0.01, rtol = 1e-7, atol = 1e-9, method = "radau" }
  local b = sys:reduce():integrate { start = at, to = 0.01, rtol = 1e-9, atol = 1e-11 }
  expect(a.status):equals "finished"
  for _, i in ipairs { 1, 100, N } do
    expect(a:final(x[i])):near(b:final(x[i]), 1e-6)
    expect(a:final(y[i].dot)):near(b:final(y[i].dot), 1e-4)
  end
end)

test("units of a chain of 2500 coupled loops stay finite", function()
  local N = 2500
  local v, w, i = var("v", N), var("w", N), var("i", N)
  local e, fix = {}, {}
  for k = 1, N do
    e[#e+1] = der(v[k]) ~ i[k] + (k > 1 and 0.1*(w[k-1] - v[k]) or 0)
    e[#e+1] = der(w[k]) ~ -i[k] - 0.3*w[k]
    e[#e+1] = 0 ~ v[k] - w[k]
    fix[v[k]] = 1
  end
  local at = dae(e):init { fix = fix }
  expect(at(w[N])):near(1, 1e-12)
  expect(at(i[1])):near(-0.15, 1e-10)                      -- v′ = i, w′ = -i - 0.3 w, v′ = w′
end)

test("a large start that no step can improve says which equation, at once", function()
  -- a chain whose points are given on a grid that is coarser than its links
  local N = 100
  local x, y = var("x", N), var("y", N)
  local T, V, C, guess = 0, 0, {}, {}
  for i = 1, N do
    local dx, dy = x[i] - (i > 1 and x[i-1] or 0), y[i] - (i > 1 and y[i-1] or 0)
    C[i] = (dx^2 + dy^2 - 1)/2
    T, V = T + (x[i].dot^2 + y[i].dot^2)/2, V + 9.81*y[i]
    guess[x[i]], guess[y[i]], guess[x[i].dot], guess[y[i].dot] = 10*(i//10), 0, 0, 0
  end
  local sys = lagrange { q = vstack(x, y), T = T, V = V, C = C }
  expect(function() sys:init {
    guess = guess } end):fails "C₁  0 = (x₁² + y₁² - 1)/2 does not hold at the values given"
  expect(function() sys:init { guess = guess } end):fails "Do points coincide that should be apart"
  for i = 1, N do guess[x[i]] = i == 4 and 3 or i end       -- one pair alone is moved apart by its neighbours
  expect(sys:init { guess = guess }((x[4] - x[3])^2 + (y[4] - y[3])^2)):near(1, 1e-9)
end)

test("index, dof and structure() of a cascade form no derivatives: the 49th of sin(t sin t) would have millions of terms", function()
  local x, e = var("x", 500), {}
  for k = 1, 500 do
    e[k] = k % 50 ~= 0 and der(x[k]) ~ x[k+1] or x[k-49] ~ sin(k > 50 and x[k-99]^2 or t*sin(t))
  end
  local sys = dae(e)
  expect(sys:structure().structural_index):equals(50)
  expect(sys:index()):equals(50)
  expect(sys:dof()):equals(0)
end)

test("hidden relations of 50 nonlinear pairs in a ring", function()
  local n = 50
  local x, y = var("x", n), var("y", n)
  local function index_of(pair)
    local e = {}
    for k = 1, n do
      local next = k % n + 1
      for _, equation in ipairs(pair(x[k], y[k], x[next], y[next])) do e[#e + 1] = equation end
    end
    local sys = dae(e)
    return ("%d, %d"):format(sys:index(), sys:dof())
  end
  expect(index_of(function(a, b, c, d)
    return { der(a) + b*der(b) ~ sin(c) - a, der(a) + b*der(b) ~ b^3 + d }
  end)):equals "1, 50"
  expect(index_of(function(a, b, c, d)
    return { der(a) + der(b) + 0.1*der(c) ~ sin(d) - a, 0 ~ a + b + 0.1*c - sin(t) }
  end)):equals "2, 0"
end)

-- a + b = sin(t + i) follows the sum of the derivatives: each pair has a hidden relation, which makes a rise
-- by its own derivative. The derivative array of all equations is too large for dense ranks; a chain has
-- closed parts that are not, a ring has none, and a direction that its array leaves open shows the index.
for kind, last in pairs { chain = false, ring = true } do
  test("300 nonlinear pairs, each coupled to the one before, have an index: a " .. kind, function()
    local a, b = var("a", 300), var("b", 300)
    local equations = {}
    for i = 1, 300 do
      local before = i > 1 and i - 1 or last and 300
      local coupling = before and sin(b[before])/10 or 0
      equations[#equations + 1] = der(a[i]) + der(b[i]) ~ a[i] + a[i]^3/9 + coupling
      equations[#equations + 1] = a[i] + b[i] ~ sin(t + i)
    end
    local sys = dae(equations)
    expect(sys:index()):equals(2)
    expect(sys:dof()):equals(0)
    local sol = sys:reduce():integrate { start = sys:init {}, to = 0.1 }
    expect(sol.status):equals "finished"
    for _, i in ipairs { 1, 2, 300 } do
      local before = i > 1 and i - 1 or last and 300
      local x, u = sol(a[i], 0.1), before and sol(b[before], 0.1) or 0
      expect(x + x^3/9 + math.sin(u)/10):near(math.cos(i + 0.1), 1e-5)
    end
  end)
end

-- x′ is determined by F₁ here, so that no direction may be called open: the structure alone says index 1.
test("600 nonlinear equations of index 1 in one block keep it", function()
  local a, b = var("a", 300), var("b", 300)
  local equations = {}
  for i = 1, 300 do
    equations[#equations + 1] = der(a[i]) ~ a[i]*b[i] - a[i*7 % 300 + 1]
    equations[#equations + 1] = 0 ~ a[i]^2 + b[i]^3 + b[i*7 % 300 + 1]/9 - sin(t + i)
  end
  expect(dae(equations):index()):equals(1)
  expect(dae(equations):dof()):equals(300)
end)

test("100 models in a ring, whose repaired structure says index 2, have index 1", function()
  local x, y, z, u = var("x", 100), var("y", 100), var("z", 100), var("u", 100)
  local equations = {}
  for i = 1, 100 do
    local before = (i - 2) % 100 + 1
    equations[#equations + 1] = der(x[i]) + der(y[i]) ~ x[i] + z[i]
    equations[#equations + 1] = der(x[i]) + der(y[i]) ~ y[i]^3 + sin(y[before])/10
    equations[#equations + 1] = z[i] + x[i] ~ u[i]
    equations[#equations + 1] = der(u[i]) ~ -u[i]
  end
  -- u = y³ + … determines y, and y′ by one differentiation
  expect(dae(equations):index()):equals(1)
  expect(dae(equations):dof()):equals(200)
end)

-- No structure and no repair: z³ = u - x hides behind x + z + u = y³ + …, and dense ranks end at 620 columns.
test("100 models in a ring without a repair have index 1, from one direction of the derivative array", function()
  local function ring(n)
    local x, y, z, u = var("x", n), var("y", n), var("z", n), var("u", n)
    local equations = {}
    for i = 1, n do
      local before = (i - 2) % n + 1
      equations[#equations + 1] = der(x[i]) + der(y[i]) ~ x[i] + z[i] + u[before]
      equations[#equations + 1] = der(x[i]) + der(y[i]) ~ y[i]^3 + sin(y[before])/10
      equations[#equations + 1] = z[i]^3 + x[i] ~ u[i]
      equations[#equations + 1] = der(u[i]) ~ x[i] - u[i]
    end
    return dae(equations)
  end
  for _, n in ipairs { 4, 100 } do  -- 4: by dense ranks
    expect(ring(n):index()):equals(1)
    expect(ring(n):dof()):equals(2*n)
  end
end)

-- Exact eliminations of such rings made fractions of hundreds of digits: index() of 200 took 9 s, and
-- reduce() 17 s, as each row of a Jacobian solved one more system in fractions.
test("linear rings of 100 and 200: index, dof and every form, by whatever road", function()
  for _, n in ipairs { 100, 200 } do
    local V = var("V" .. n, n)
    local regular, cut = {}, {}
    for k = 1, n do
      local after = V[k % n + 1]
      regular[k] = (1 + k)*der(V[k]) - der(after) ~ -V[k]
      cut[k] = (1 + k)*(der(V[k]) - der(after)) ~ -V[k] + (k == 1 and sin(t) or 0)
    end
    expect(dae(regular):index()):equals(0)
    expect(dae(regular):dof()):equals(n)
    local sys = dae(cut)                               -- 0 = sum of the right sides, divided by 1 + k
    expect(sys:index()):equals(1)
    expect(sys:dof()):equals(n - 1)
    if n == 100 then
      local guess = {}
      for k = 1, n do guess[k] = math.cos(k) end
      local start = sys:init { guess = { [V] = guess } }
      local as_written = sys:integrate { start = start, to = 0.5, rtol = 1e-9, method = "radau" }
      for _, form in ipairs { "ode", "project", "acc", "dummy", "array" } do
        local sol = sys:reduce(form):integrate { start = start, to = 0.5, rtol = 1e-9 }
        for _, k in ipairs { 1, 3, 50 } do expect(sol:final(V[k])):near(as_written:final(V[k]), 1e-7) end
      end
    end
  end
end)

test("form array says how large a model it is for", function()
  local x, y, l = var("x", 150), var("y", 150), var("l", 150)
  local equations = {}
  for k = 1, 150 do
    equations[#equations + 1] = der(x[k]) ~ y[k] + l[k]*x[k]
    equations[#equations + 1] = der(y[k]) ~ -x[k] + l[k]*y[k]
    equations[#equations + 1] = 0 ~ x[k]^2 + y[k]^2 - 1
  end
  expect(function() return dae(equations):reduce "array" end)
    :fails "unknowns and derivatives; it is for at most"
end)
