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

test("a decay constant that falls: one change, or two at few digits, to an explicit pair", function()
  for _, unit in ipairs { 1, 1e-6, 3600 } do                   -- of time
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
      local equations = {
        der(x) ~ -1e4/unit*exp(-t/unit)*(x - cos(5*t/unit)), der(y) ~ z/unit,
        der(z) ~ -y*(1 + 0.1*x)/unit,
      }
      local changes, last = road(compared(equations, { x = 1, y = 1, z = 0 }, 300*unit, rtol))
      expect(changes):equals(rtol == 1e-4 and 2 or 1)         -- rodas5p by radau first: many steps alike
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

test("one of two stiff parts that know nothing of each other comes to rest: no explicit step", function()
  local u, w = vars "u w"
  for _, rtol in ipairs { 1e-4, 1e-6 } do
    local sol = compared({ der(x) ~ -1e5*exp(-t)*(x - cos(5*t)), der(y) ~ -3e3*(y - u), der(u) ~ w,
      der(w) ~ -sin(u) }, { x = 1, y = 1, u = 1, w = 0 }, 60, rtol)
    expect(sol:stats().method:find "verner" == nil):is_true()
  end
end)

test("an algebraic unknown, and an event behind the change", function()
  local u, w = vars "u w"                                      -- swing on, which keeps all steps short
  local model = dae { der(x) ~ -1e4*exp(-t)*(x - cos(5*t)), 0 ~ z - x - 2*y, der(y) ~ -y*0.01, der(u) ~ w,
    der(w) ~ 3*(1 - u^2)*w - u }
  local sol = model:integrate { start = { x = 1, y = 1, u = 2, w = 0 }, to = 300, rtol = 1e-6,
    events = { { when = y - 0.1, action = "stop" } } }
  expect(sol.status):equals "event"
  expect(sol.t[#sol.t]):near(100*math.log(10), 1e-3)
  expect((road(sol))):equals(1)
  expect(sol(z, 222.2) - sol(x, 222.2)):near(2*math.exp(-2.222), 1e-6)
end)

-- Work: passes over the equations; iterations and matrices are some more.
local function work(sol)
  local s = sol:stats()
  return s.evaluations + s.newton + s.jacobians + s.factorisations
end
local function runs(equations, start, to, rtol)
  local model = dae(equations)
  return function(method)
    local sol = model:integrate { start = start, to = to, rtol = rtol, atol = rtol/100, method = method,
      times = { to } }
    expect(sol.status):equals "finished"
    return sol
  end
end

test("oscillators that are a little stiff: explicit steps are forecast, in any unit of time", function()
  for _, mu in ipairs { 5, 8 } do
    for _, rtol in ipairs { 1e-6, 1e-7 } do
      local first
      for _, unit in ipairs { 1, 1e-6, 3600 } do
        local run = runs({ der(x) ~ y/unit, der(y) ~ (mu*(1 - x^2)*y - x)/unit }, { x = 2, y = 0 },
          60*unit, rtol)
        local sol = run()
        local changes, last = road(sol)
        expect(last):equals "verner87"
        expect(changes):equals(1)
        expect(work(sol) < 1.25*work(run "verner87")):is_true()
        first = first or sol:stats().steps
        expect(math.abs(sol:stats().steps - first) < 0.1*first):is_true()
      end
    end
  end
end)

test("accuracy keeps explicit steps short beside what decays fast: radau is tried and kept", function()
  -- x follows a switched source; λ is 6 to 60, for an interval that is too short to begin with radau
  local k = (1 + tanh(4*sin(t/3)))/2
  local equations = { der(x) ~ 2*k - 30*x*y - x, der(y) ~ 20*k*(1 - y) - 30*x*y }
  local start = { x = 0, y = 0.1 }
  local run, tight = runs(equations, start, 40, 1e-9), runs(equations, start, 40, 1e-12) "radau"
  local sol = run()
  expect(sol:stats().why):matches "implicit ones are tried"
  local changes, last = road(sol)
  expect(changes):equals(1)
  expect(last):equals "radau"
  expect(2*work(sol) < work(run "verner87")):is_true()
  for _, state in ipairs { x, y } do expect(sol:final(state)):near(tight:final(state), 1e-8) end
  -- what swings is not stiff
  local pendulum = runs({ der(x) ~ y, der(y) ~ -sin(x) - 0.02*y }, { x = 1, y = 0 }, 300, 1e-9)
  expect((road(pendulum()))):equals(0)
end)

test("steps of a Rosenbrock method that are many and alike: radau goes on", function()
  local run = runs({ der(x) ~ -300*(x - cos(5*t)), der(y) ~ z, der(z) ~ -sin(y)*(1 + x/10) },
    { x = 1, y = 1, z = 0 }, 100, 1e-4)
  local sol = run()
  local changes, last = road(sol)
  expect(changes):equals(1)
  expect(last):equals "radau"
  expect(2*sol:stats().steps < run(rosenbrock.rodas5p):stats().steps):is_true()
  local few = runs({ der(x) ~ -300*(x - y), der(y) ~ -y + z^2, der(z) ~ -z }, { x = 1, y = 1, z = 1 }, 30,
    1e-4)
  expect((road(few()))):equals(0)                              -- a transient that ends
end)

-- |λ| lets explicit steps be long; at tight tolerances what follows cos(5 t) with λ = -30 needs short ones.
test("the explicit method that is more work than was forecast is left again", function()
  local run = runs({ der(x) ~ -30*(x - cos(5*t)), der(y) ~ z, der(z) ~ -sin(y)*(1 + x/10) },
    { x = 1, y = 1, z = 0 }, 60, 1e-8)
  local sol, implicit = run(), run "radau"
  local changes, last = road(sol)
  expect(changes <= 4):is_true()
  expect(last):equals "radau"
  expect(sol:stats().why):matches "the explicit method takes more work"
  expect(sol:stats().steps < 1.3*implicit:stats().steps + 60):is_true()
  for _, state in ipairs { x, y, z } do expect(sol:final(state)):near(implicit:final(state), 1e-5) end
end)

-- Every stage of an explicit step solves nine cubic equations.
test("inverters in a ring: no more work than by the method that takes least", function()
  local N = 9
  local v, w = var("v", N), var("w", N)
  local start, equations = {}, {}
  for k = 1, N do
    start[k] = math.sin(2*k)
    equations[#equations + 1] = der(v[k]) ~ 4*(w[k] - v[k])
    equations[#equations + 1] = 0 ~ w[k] + w[k]^3/10 + tanh(3*v[k > 1 and k - 1 or N])
  end
  for _, rtol in ipairs { 1e-4, 1e-7 } do
    local run = runs(equations, { [v] = start }, 50, rtol)
    local sol, explicit, radau = run(), run "verner87", run "radau"
    expect((road(sol)) <= 5):is_true()
    expect(work(sol) < 1.25*math.min(work(radau), work(explicit))):is_true()
    for k = 1, N do expect(sol:final(v[k])):near(explicit:final(v[k]), 1e3*rtol) end
  end
end)
