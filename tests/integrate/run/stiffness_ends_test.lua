-- The default goes back to an explicit method where stiffness ends, and stays where it comes again.
local x, y, z = vars "x y z"

-- How often the method changed, and the method of the end.
local function road(sol)
  local name = sol:stats().method
  local _, changes = name:gsub(", then ", "")
  return changes, name:match "([^ ]+)$"
end

local function compared(equations, start, to, rtol)
  local model = dae(equations)
  local options = { start = start, to = to, rtol = rtol, atol = rtol/100 }
  local reference = model:integrate { start = start, to = to, rtol = 1e-11, atol = 1e-13, method = "radau" }
  local sol = model:integrate(options)
  expect(sol.status):equals "finished"
  for _, state in ipairs { x, y } do
    for _, share in ipairs { 0.3, 0.77, 1 } do
      local exact = reference(state, share*to)
      expect(math.abs(sol(state, share*to) - exact)/(rtol*math.max(1, math.abs(exact))) < 50):is_true()
    end
  end
  return sol
end

test("a decay constant that falls: one change, to an explicit pair", function()
  for _, unit in ipairs { 1, 1e-6, 3600 } do                   -- of time
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
      local equations = {
        der(x) ~ -1e4/unit*exp(-t/unit)*(x - cos(5*t/unit)), der(y) ~ z/unit,
        der(z) ~ -y*(1 + 0.1*x)/unit,
      }
      local changes, last = road(compared(equations, { x = 1, y = 1, z = 0 }, 300*unit, rtol))
      expect(changes):equals(1)
      expect(last):equals "verner87"
    end
  end
end)

test("an oscillator that is stiff at its start only", function()
  local sol = compared({ der(x) ~ y, der(y) ~ 10*(1 - x^2)*y - x }, { x = 2, y = 0 }, 90, 1e-6)
  local changes, last = road(sol)
  expect(changes):equals(1)
  expect(last):equals "verner87"
end)

test("relaxation oscillations: jumps are passed with few changes", function()
  for _, mu in ipairs { 1e2, 1e3, 1e6 } do
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
      local sol = dae { der(x) ~ y, der(y) ~ mu*((1 - x^2)*y - x) }
        :integrate { start = { x = 2, y = -0.66 }, to = 11, rtol = rtol, atol = rtol }
      expect(sol.status):equals "finished"
      local radau = dae { der(x) ~ y, der(y) ~ mu*((1 - x^2)*y - x) }
        :integrate { start = { x = 2, y = -0.66 }, to = 11, rtol = rtol, atol = rtol, method = "radau" }
      expect((road(sol)) <= 8):is_true()
      expect(math.abs(sol:final(x) - radau:final(x)) < 1000*rtol):is_true()
    end
  end
end)

test("stiff throughout: no change", function()
  local sol = compared({ der(x) ~ -1e4*(x - cos(5*t)), der(y) ~ z, der(z) ~ -y*(1 + 0.1*x) },
    { x = 1, y = 1, z = 0 }, 100, 1e-6)
  expect((road(sol))):equals(0)
end)

test("an algebraic unknown, and an event behind the change", function()
  local model = dae { der(x) ~ -1e4*exp(-t)*(x - z), 0 ~ z - cos(5*t), der(y) ~ -y*0.01 }
  local sol = model:integrate { start = { x = 1, y = 1 }, to = 300, rtol = 1e-6,
    events = { { when = y - 0.1, action = "stop" } } }
  expect(sol.status):equals "event"
  expect(sol.t[#sol.t]):near(100*math.log(10), 1e-3)
  expect((road(sol))):equals(1)
  expect(sol(z, 222.2)):near(math.cos(5*222.2), 1e-6)
end)

-- Eigenvalues let an explicit method take long steps, but each solves nine cubic equations at every stage,
-- and fast swings keep its steps short: at few digits it is tried and left. At more, explicit steps stay:
-- radau has to look between its stages in every step.
test("inverters in a ring: the explicit method that is more work is left again", function()
  local N = 9
  local v, w = var("v", N), var("w", N)
  local start, equations = {}, {}
  for k = 1, N do
    start[k] = math.sin(2*k)
    equations[#equations + 1] = der(v[k]) ~ 4*(w[k] - v[k])
    equations[#equations + 1] = 0 ~ w[k] + w[k]^3/10 + tanh(3*v[k > 1 and k - 1 or N])
  end
  local ring = dae(equations)
  for rtol, last in pairs { [1e-4] = "rodas5p", [1e-7] = "verner87" } do
    local function run(method)
      return ring:integrate { start = { [v] = start }, to = 50, rtol = rtol, atol = rtol, method = method }
    end
    local sol, explicit = run(), run "verner87"
    local implicit = run(last == "rodas5p" and rosenbrock.rodas5p or "radau")
    local changes, ends = road(sol)
    expect(ends):equals(last)
    expect(changes <= 4):is_true()
    local least = math.min(implicit:stats().evaluations, explicit:stats().evaluations)
    expect(sol:stats().evaluations < 1.15*least):is_true()
    if last == "rodas5p" then expect(sol:stats().why):matches "the explicit method takes more work" end
    for k = 1, N do expect(sol(v[k], 50)):near(explicit(v[k], 50), 1e3*rtol) end
  end
end)
