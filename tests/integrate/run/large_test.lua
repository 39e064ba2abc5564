-- Large models from their equations to the solution, and runs of many steps.
local sanitized = os.getenv "PENDULA_SANITIZED"

local function chain(N)
  local x, y, u, v, lam = var("x", N), var("y", N), var("u", N), var("v", N), var("lam", N)
  local equations, start, s = {}, { [x] = {}, [y] = {}, [u] = {}, [v] = {} }, math.sqrt(1/2)/N
  local function dx(i) return i > 1 and x[i] - x[i - 1] or x[1] end
  local function dy(i) return i > 1 and y[i] - y[i - 1] or y[1] end
  for i = 1, N do
    local fx, fy = -lam[i]*dx(i), -lam[i]*dy(i)
    if i < N then fx, fy = fx + lam[i + 1]*dx(i + 1), fy + lam[i + 1]*dy(i + 1) end
    equations[#equations + 1] = der(x[i]) ~ u[i]
    equations[#equations + 1] = der(y[i]) ~ v[i]
    equations[#equations + 1] = der(u[i])/N ~ fx
    equations[#equations + 1] = der(v[i])/N ~ fy - 9.81/N
    equations[#equations + 1] = 0 ~ (dx(i)^2 + dy(i)^2 - (1/N)^2)/2
    start[x][i], start[y][i], start[u][i], start[v][i] = i*s, -i*s, 0, 0
  end
  return dae(equations), start, x, y
end

test("a chain of 10 links ends where docs/benchmarks.md says", function()
  local model, start, x, y = chain(10)
  local sol = model:reduce():integrate { start = start, to = 1, rtol = 1e-9, atol = 1e-9, times = { 1 } }
  expect(sol(x[10], 1)):near(-0.6794899319, 2e-9)
  expect(sol(y[10], 1)):near(-0.7271122386, 2e-9)
end)

test("a chain of 120 links is an explicit ODE, keeps its links, and agrees with the form of index 1",
  function()
  local N = sanitized and 70 or 120
  local model, start, x, y = chain(N)
  local low = model:reduce()
  local at = low:init { fix = start }
  local sol = low:integrate { start = at, to = 0.2, rtol = 1e-7, atol = 1e-7, times = { 0.2 } }
  expect(sol.status):equals "finished"
  expect(sol:stats().jacobians):equals(0)
  for i = 2, N, 17 do
    local length = sol((x[i] - x[i - 1])^2 + (y[i] - y[i - 1])^2, 0.2)
    expect(length*N^2):near(1, 1e-4)  -- rtol·|x| on differences of 1/N
  end
  local other = model:reduce "acc":integrate { start = at, to = 0.2, rtol = 1e-8, atol = 1e-8,
    times = { 0.2 }, method = "radau" }
  expect(sol(x[N], 0.2)):near(other(x[N], 0.2), 1e-6)
  expect(sol(y[N], 0.2)):near(other(y[N], 0.2), 1e-6)
end)

test("a ladder of 400 diodes by a Rosenbrock method", function()
  local N = 400
  local w, v = var("w", N), var("v", N)
  local equations, zero = {}, {}
  for k = 1, N do
    local before = k > 1 and v[k - 1] or 2*sin(2*pi*1e5*t)
    local current = (w[k] - v[k])/10
    if k < N then current = current + (w[k + 1] - v[k])/10 end
    equations[#equations + 1] = 0 ~ (before - w[k])/10 + (v[k] - w[k])/10 - 1e-12*(exp(w[k]/0.02585) - 1)
    equations[#equations + 1] = 1e-9*der(v[k]) ~ current
    zero[k] = 0
  end
  local model = dae(equations)
  local sol = model:integrate { start = { [v] = zero, [w] = zero }, to = 1e-5, rtol = 1e-5, atol = 1e-5,
    times = { 1e-5 } }
  expect(tostring(sol:stats())):matches "rodas"
  expect(sol(v[5], 1e-5)):near(-0.53731799736, 1e-6)  -- radau and bdf at rtol = 1e-11
  expect(sol(w[6], 1e-5)):near(-0.56385766819, 1e-6)
end)

test("with given times memory is flat over 3·10⁶ steps, and what was not kept is not invented", function()
  local status = io.open "/proc/self/status"
  if not status or sanitized then return end
  status:close()
  local function resident()
    local file <close> = io.open "/proc/self/status"
    return tonumber(file:read "a":match "VmRSS:%s*(%d+)")/1024
  end
  local x = var "x"
  local model = dae { der(x, 2) ~ -x }
  collectgarbage()
  local before = resident()
  local sol = model:integrate { start = { x = 1, [x.dot] = 0 }, to = 3000, rtol = 1e-6, atol = 1e-6,
    dtmax = 1e-3, method = "dopri5", times = { 500, 3000 } }
  expect(sol:stats().steps >= 3000000):equals(true)
  expect(resident() - before < 100):equals(true)  -- MB; all steps with their ends would be 168 MB
  expect(sol(x, 3000)):near(math.cos(3000), 1e-6)
  expect(function() return sol(x, 700) end):fails "not one of the times"
end)

test("reduce() of a chain grows with its length, not with a power of it", function()
  local function seconds(N)
    local model = chain(N)
    local before = os.clock()
    expect(tostring(model:reduce())):matches "ODE"
    return os.clock() - before
  end
  seconds(50)
  expect(seconds(800) < 12*seconds(200) + 0.1):is_true()      -- 4 where it is linear, 30 and more before
end)
