-- Chains x_k′ = x_(k+1) + f(x_k, x₁), 0 = g(x₁) - sin t of high index: the start against power series.

-- Truncated power series in t as lists of coefficients, c[1] that of t⁰.
local function product(a, b)
  local c = {}
  for k = 1, #a do
    c[k] = 0
    for i = 1, k do c[k] = c[k] + a[i] * b[k + 1 - i] end
  end
  return c
end
local function slope(a)
  local c = {}
  for k = 1, #a - 1 do c[k] = k * a[k + 1] end
  return c
end

-- x₁ with x₁ + x₁³/10 = sin t, by fixed-point iteration: each adds coefficients.
local function first(n)
  local sine, x = {}, {}
  local value = { 0, 1, 0, -1 }
  local factorial = 1
  for k = 0, n do
    if k > 0 then factorial = factorial * k end
    sine[k + 1], x[k + 1] = value[k % 4 + 1] / factorial, 0
  end
  for _ = 0, n do
    local cube = product(x, product(x, x))
    local next = {}
    for k = 1, n + 1 do next[k] = sine[k] - cube[k] / 10 end
    x = next
  end
  return x
end

-- The values of x₁ … x_n at t = 0: x_(k+1) = x_k′ - x₁ x_k/5.
local function expected(n)
  local values, one = {}, first(n)
  local x = one
  for k = 1, n do
    values[k] = x[1]
    local rate, shared = slope(x), product(table.move(one, 1, #x, 1, {}), x)
    x = {}
    for i = 1, #rate do x[i] = rate[i] - shared[i] / 5 end
  end
  return values
end

local function chain(n, name)
  local x, equations = var(name, n), {}
  for k = 1, n - 1 do equations[k] = der(x[k]) ~ x[k + 1] + x[1] * x[k] / 5 end
  equations[n] = 0 ~ x[1] + x[1]^3 / 10 - sin(t)
  return dae(equations), x
end

test("chains of index 6 to 20 start in milliseconds, at the values of the power series", function()
  for _, n in ipairs { 6, 7, 10, 14, 20 } do
    local sys, x = chain(n, "link")
    local begin = os.clock()
    local start = sys:init{}
    local seconds, values = os.clock() - begin, expected(n)
    for k = 1, n do
      local error = math.abs(start(x[k]) - values[k]) / (1 + math.abs(values[k]))
      local found = ("x%d of %d: %g, not %g"):format(k, n, start(x[k]), values[k])
      expect(error < 1e-8 and "right" or found):equals "right"
    end
    local most = os.getenv "PENDULA_SANITIZED" and 30 or 2
    expect(seconds < most and "quick" or ("index %d: %.1f s"):format(n, seconds)):equals "quick"
    expect(tostring(start):find("0 free initial values", 1, true) ~= nil):equals(true)
    expect(sys:index()):equals(n)
  end
end)

-- In another unit of time, x₁⁽¹⁷⁾ is 10⁻⁵¹ or 10⁵¹ times what it was.
test("chains of index 18 have their index and start in milliseconds and in kiloseconds, too", function()
  local values = expected(18)
  for _, unit in ipairs { 1e-3, 1e3 } do
    local x, equations = var("later", 18), {}
    for k = 1, 17 do equations[k] = der(x[k]) ~ unit * (x[k + 1] + x[1] * x[k] / 5) end
    equations[18] = 0 ~ x[1] + x[1]^3 / 10 - sin(unit * t)
    local sys = dae(equations)
    expect(sys:index()):equals(18)
    local start = sys:init{}
    for k = 1, 18 do
      expect(math.abs(start(x[k]) - values[k]) < 1e-8 * (1 + math.abs(values[k]))):equals(true)
    end
  end
end)

-- Its Jacobian is triangular, with ones and 1 + cos(x₁)/2; terms e^(-x₁²) x_k/7 make the units of its columns
-- decrease.
test("a chain that decays is not singular", function()
  local x, equations = var("fade", 16), {}
  for k = 1, 15 do equations[k] = der(x[k]) ~ x[k + 1] + exp(-x[1]^2) * x[k] / 7 end
  equations[16] = 0 ~ x[1] + sin(x[1]) / 2 - cos(t) / (2 + t)
  local sys = dae(equations)
  expect(sys:index()):equals(16)
  expect(sys:dof()):equals(0)
end)

test("what cannot be written out is not: traces and conditions of index 10 are short", function()
  local sys = chain(10, "link")
  local low = sys:reduce "acc"
  expect(#tostring(low:trace()) < 200000):equals(true)
  expect(#tostring(low) < 100000):equals(true)
  expect(low:index()):equals(1)
  expect(sys:dof()):equals(0)
end)
