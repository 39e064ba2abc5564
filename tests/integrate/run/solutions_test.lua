-- Integration as a user types it: what comes back, and what is said when it cannot be done.
local x, y, z = vars "x y z"
local m, g, L = params "m=1 g=9.81 L=1"
local p, v = var("p", 3), var("v", 3)
local decay = dae { der(x) ~ -2 * x }
local ball = dae { der(p) ~ v, m * der(v) ~ -m * g * vec { 0, 0, 1 } - z * p, 0 ~ (p.T * p - L^2) / 2 }
local low = ball:reduce "acc"
local at = ball:init { fix = { [p] = { 1, 0, 0 }, [v] = { 0, 1, 0 } } }

test("published end values of x' = -2x", function()
  local function final(tab) return decay:integrate { start = { x = 1 }, to = 2, method = tab,
    dt = 0.1 }:final(x) end
  expect(final(rk.euler)):near(0.0115292150460685, 1e-16)    -- all digits printed
  expect(final(rk.midpoint)):near(0.0188919613181312, 1e-16)
  expect(final(rk.heun)):near(0.0188919613181312, 1e-16)     -- the same R(z)
  expect(final(rk.rk4)):near(0.0183167933693744, 1e-16)
  expect(final(rk.kutta38)):near(0.0183167933693744, 1e-16)
  expect(final(rk.gauss(2))):near(0.01831580208277, 1e-14)
end)

test("the 3-D pendulum in index-1 form", function()
  local sol = low:integrate { start = at, to = 2, method = rk.gauss(4), dt = 0.02 }
  expect(sol.status):equals "finished"
  local reference = { 0.579251157202, 0.588246716733, -0.564299474688, 0.426250340232, 2.159236710359,
    2.688412760251 }
  expect(sol:final(vstack(p, v))):near(reference, 2e-12)     -- reference rounded at 5e-13
  local step = low:integrate { start = at, to = 0.1, method = rk.gauss(2), dt = 0.1 }
  expect(step:final(vstack(p, v))):near({ 0.99380511106767, 0.09975339146509, -0.04897968173065,
    -0.14771301968379,
    0.99140678021318, -0.97799257963048 }, 1e-14)            -- printed to 5e-15
  expect(sol(z, 0)):near(at(z), 1e-12)
  expect(sol(der(v[3]), 1)):near(-9.81 - sol(z * p[3], 1), 1e-12)
end)

test("the same pendulum in other words has the same solution", function()
  local q = var("q", 3)
  local spherical = lagrange { q = q, T = m / 2 * q.dot.T * q.dot, V = m * g * q[3],
    C = { (q.T * q - L^2) / 2 } }
  local reduced = spherical:reduce()
  local sol = reduced:integrate { start = { [q] = { 1, 0, 0 }, [q.dot] = { 0, 1, 0 } }, to = 2,
    method = rk.gauss(4), dt = 0.02 }
  local other = low:integrate { start = at, to = 2, method = rk.gauss(4), dt = 0.02 }
  -- 100 steps, a few ε each, amplified by less than 20
  expect(sol:final(q)):near(other:final(p), 1e-12)
  expect(sol(spherical.energy, 2)):near(sol(spherical.energy, 0), 1e-9)
end)

test("values at saved times, at one time, at several times", function()
  local sol = decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.25 }
  expect(sol.t):near { 0, 0.25, 0.5, 0.75, 1 }
  expect(#sol(x)):equals(5)
  expect(sol(x).cols):equals(1)
  expect(sol(vec { x, x^2 }).cols):equals(2)
  expect(sol "x"):equals(sol(x))
  expect(sol(x, 0)):equals(1.0)
  expect(sol(vec { x, -x }, 0)):near { 1, -1 }
  expect(sol(x, { 0, 1 })):near({ 1, sol:final(x) }, 0)
  expect(sol(der(x), 1)):near(-2 * sol(x, 1), 1e-15)
  expect(function() sol(x, 2) end):fails "t = 2 lies outside the solution, which covers 0 ≤ t ≤ 1"
  local blown = dae { der(x) ~ x^2 }:integrate { start = { x = 1 }, to = 3 }
  expect(function() blown(x, 2) end):fails "; it stopped at t = 1: "
  local halted = dae { der(x) ~ -x }:integrate { start = { x = 1 }, to = 3,
    events = { { when = x - 0.5, action = "stop" } } }
  expect(function() halted(x, 2) end):fails "an event ended it"
  expect(function() sol(y) end):fails "y"
end)

test("times, from, params, inputs", function()
  local u, k = input "u", param "k"
  local driven = dae { der(x) ~ k * u }
  local sol = driven:integrate { start = { x = 0 }, from = 1, to = 2, dt = 0.1, method = rk.gauss(2),
    times = { 1, 1.25, 2 },
    params = { k = 3 }, inputs = { [u] = function(s) return s^2 end } }
  expect(sol.t):near({ 1, 1.25, 2 }, 0)
  expect(sol:final(x)):near(7, 1e-14)                        -- ∫ 3 t² from 1 to 2; degree 3 is exact
  expect(sol(u, 1.25)):near(1.5625, 1e-15)
  local function branches(s) if s < 1.5 then return 0 else return 1 end end
  local jump = driven:integrate { start = { x = 0 }, from = 1, to = 2, dt = 0.25, method = rk.euler,
    params = { k = 3 },
    inputs = { u = branches } }
  expect(jump:final(x)):near(1.5, 1e-15)
  expect(function()
    driven:integrate { start = { x = 0 }, to = 1, dt = 0.1, method = rk.rk4, params = { k = 1 },
      inputs = { u = function(s)
      if s > 0.5 then error "the valve is stuck" end return 0 end } }
  end):fails "the valve is stuck"
  expect(function() driven:integrate { start = { x = 0 }, to = 1, dt = 0.1, method = rk.rk4,
    params = { k = 1 } } end):fails "u"
  expect(function() driven:integrate { start = { x = 0 }, to = 1, dt = 0.1, method = rk.rk4,
    inputs = { u = 1 } } end):fails "k"
end)

test("a start made with other parameters keeps them", function()
  local k = param("k", 1)
  local growth = dae { der(x) ~ k * x, 0 ~ z - k * x }
  local function final(options)
    options.to, options.dt, options.method = 1, 1, rk.euler
    return growth:integrate(options):final(x)
  end
  expect(final { start = growth:init { fix = { x = 1 } } }):near(2)
  expect(final { start = growth:init { fix = { x = 1 }, params = { k = 2 } } }):near(3)
  expect(final { start = { x = 1 }, params = { k = 2 } }):near(3)
  local other = growth:with { k = 4 }
  expect(other:integrate { start = growth:init { fix = { x = 1 } }, to = 1, dt = 1,
    method = rk.euler }:final(x)):near(5)
end)

test("a solution that ceases to exist stops with status and time", function()
  local sol = dae { der(x) ~ x^2 }:integrate { start = { x = 1 }, to = 3, dt = 0.01,
    method = rk.implicit_euler }
  expect(sol.status):matches "^stopped at t = 0%.9%d*: Newton did not converge"
  expect(sol:final(x) > 10):is_true()
  local explicit = dae { der(x) ~ x^2 }:integrate { start = { x = 1 }, to = 3, dt = 0.01, method = rk.rk4 }
  expect(explicit.status):matches "^stopped at t = 1%.%d*: x.* is not finite"
end)

test("a solution without saved points says so", function()
  local sol = dae { der(x) ~ x^2 }:integrate { start = { x = 1 }, times = { 5 }, dt = 0.01,
    method = rk.implicit_euler }
  expect(sol.status):matches "^stopped at t = 0%.9"
  expect(#sol(x)):equals(0)
  expect(tostring(sol)):matches "^solution: stopped"
  for _, f in ipairs { function() sol:final() end, function() sol:final(x) end, function()
    sol(x, 1) end, function() sol:drift() end } do
    expect(f):fails "the solution holds no points: stopped"
  end
end)

test("what cannot be integrated is refused with the remedy", function()
  local function refuse(model, options, words)
    expect(function()
      local all = { start = { x = 1 }, to = 1, dt = 0.1, method = rk.rk4 }
      for key, value in pairs(options) do all[key] = value ~= "none" and value or nil end
      model:integrate(all)
    end):fails(words)
  end
  refuse(ball, { start = at }, "the model has index 3")
  refuse(ball, { start = at }, "sys:reduce():integrate")
  refuse(decay, { dt = 0 }, "dt = 0; the step must be a positive number")
  refuse(decay, { dt = -1 }, "dt = -1; the step must be a positive number")
  refuse(decay, { dt = 0 / 0 }, "dt")
  refuse(decay, { dt = "none" }, "give dt = 0.01")
  refuse(decay, { to = -1 }, "to = -1 must be greater than from = 0")
  refuse(decay, { to = "none" }, "give to = 10")
  refuse(decay, { to = math.huge }, "from and to must be finite")
  refuse(decay, { method = "none" }, "method is missing")
  refuse(decay, { method = "rk5" }, "rk5")
  refuse(decay, { method = 4 }, "'method': expected a string or tableau")
  refuse(decay, { start = "none" }, "needs a start")
  refuse(decay, { times = {} }, "times is empty")
  refuse(decay, { times = { 0.5, 0.1 } }, "times must increase")
  refuse(decay, { times = { 5 } }, "lies outside 0 ≤ t ≤ 1")
  refuse(decay, { times = { "x" } }, "times")
  refuse(decay, { step = 3 }, "step")
  refuse(decay, { dt = 1e-12 }, "too many to save")
end)

test("drift: consistent, inconsistent, numerical, and none", function()
  local function drift(start, tab, dt)
    return low:integrate { start = start, to = 10, method = tab, dt = dt }:drift()
  end
  expect(drift(at, rk.gauss(3), 0.02).verdict):equals "kept"
  expect(drift(at, rk.heun, 0.02).verdict):equals "numerical drift"
  local off = low:init { consistent = false, fix = { [p] = { 1, 0, 0 }, [v] = { 0.1, 1, 0 } } }
  local wrong = drift(off, rk.gauss(3), 0.02)
  expect(wrong.verdict):equals "inconsistent start"
  expect(wrong[1].slope):near(0.1, 1e-12)
  expect(wrong[1].line):near(1, 1e-11)
  expect(wrong[1].numerical < 1e-6):is_true()
  expect(tostring(wrong)):matches "straight line C%(0%) %+ t C′%(0%)"
  expect(tostring(decay:integrate { start = { x = 1 }, to = 1, dt = 0.1,
    method = rk.rk4 }:drift())):matches "no constraints"
  local index1 = dae { der(x) ~ -z, 0 ~ z - x^2 }
  expect(index1:integrate { start = { x = 1 }, to = 1, dt = 0.1,
    method = rk.rk4 }:drift().verdict):equals "kept"
end)

test("an index-3 model as it stands", function()
  local sol = ball:integrate { start = at, to = 0.1, dt = 0.001, method = rk.radau(3), direct = true }
  local exact = low:integrate { start = at, to = 0.1, dt = 0.01, method = rk.gauss(4) }
  -- order s = 3 in the velocities, constants below 100
  expect(sol:final(p)):near(exact:final(p), 1e-7)
  expect(sol:final(z)):near(exact:final(z), 1e-4)            -- order s - 1 = 2
  expect(function() ball:integrate { start = at, to = 1, dt = 0.01, method = rk.rk4,
    direct = true } end):fails "gives no z"
end)

test("statistics and printing are the same on every run", function()
  local sol = decay:integrate { start = { x = 1 }, to = 1, dt = 0.1, method = rk.implicit_euler }
  local stats = sol:stats()
  expect(stats.steps):equals(10)
  expect(stats.newton):equals(10)
  expect(stats.method):equals "implicit_euler"
  expect(stats.time >= 0):is_true()
  expect(tostring(sol)):equals "solution by implicit_euler, dt = 0.1: 10 steps from t = 0 to 1, finished\n  x  =  0.1615055829"
  expect(tostring(stats)):matches "^method%s+implicit_euler\nsteps%s+10\n"
end)

test("tableaus that are refused", function()
  local function refuse(argument, words) expect(function() tableau(argument) end):fails(words) end
  refuse({ A = { {}, { "1/2" }, { 0, "3/4" }, { "2/9", "1/3", "5/9" } }, b = { "2/9", "1/3", "4/9", 0 },
    c = { 0, "1/2", "3/4", 1 },
    name = "bogacki" }, "tableau 'bogacki': row 4 of A sums to 10/9, but c[4] = 1")
  refuse({ A = { { 0 } }, b = { 2 } }, "b sums to 2, not 1")
  refuse({ A = { { 0 } }, b = { 1, 0 } }, "b has 2 entries, but A has 1 row")
  refuse({ A = { { 0, 1 } }, b = { 1 } }, "row 1 of A has 2 entries for 1 stage")
  refuse({ A = { 1 }, b = { 1 } }, "row 1 of A must be a list")
  refuse({ A = {}, b = {} }, "A is empty")
  refuse({ A = { { "1/0" } }, b = { 1 } }, "row 1 of A[1]")
  refuse({ A = { { "2 gamma" } }, b = { 1 } }, "is not a number")
  refuse({ A = { { x } }, b = { 1 } }, "coefficient x depends on time")
  refuse({ A = { { 0 } }, b = { 1 }, order = 2 }, "order 2 is claimed, but the order conditions give 1")
  refuse({ A = { { 0 } }, b = { 1 }, d = 2 }, "d")
  refuse({ b = { 1 } }, "A and b are required")
  refuse("", "no line of the form")
  refuse("0 |", "the weights are missing")
  expect(function() rk.gauss(0) end):fails "between 1 and 100"
  expect(function() rk.gauss(1e6) end):fails "between 1 and 100"
  expect(function() rk.gauss "two" end):fails "stages"
  expect(function() rk.rk5() end):fails "Did you mean 'rk4'?"
  expect(function() rk.collocation {} end):fails "at least one node"
  expect(function() rk.collocation { 1, 1 } end):fails "nodes 1 and 2 are equal"
  expect(function() rk.rk4:is "stable" end):fails "unknown property 'stable'"
end)

test("tableaus from drawings, doubles and expressions are the same", function()
  local a = tableau { A = { { "1/4", "1/4-sqrt(3)/6" }, { "1/4+sqrt(3)/6", "1/4" } }, b = { 0.5, 0.5 } }
  local b = tableau [[
    1/2-sqrt(3)/6 │ 1/4            1/4-sqrt(3)/6
    1/2+sqrt(3)/6 │ 1/4+sqrt(3)/6  1/4
    ──────────────┼─────────────────────────────
                  │ 1/2            1/2 ]]
  local c = tableau { A = { { 1 / 4, 1 / 4 - sqrt(3) / 6 }, { 1 / 4 + sqrt(3) / 6, 1 / 4 } },
    b = { 1 / 2, 1 / 2 } }
  for _, tab in ipairs { a, b, c } do
    expect(tab:order()):equals(4)
    expect(tab:is "symplectic"):is_true()
    expect(tab.A):near(rk.gauss(2).A, 0)
  end
end)

test("drift knows how form baumgarte lets an inconsistent start decay", function()
  local q, gain = var("q", 2), param("gain", 4)
  local pendulum = lagrange { q = q, T = q.dot.T * q.dot / 2, V = 9.81 * q[2], C = { (q.T * q - 1) / 2 } }
  local C, start = (q.T * q - 1) / 2, { [q] = { 0.66, -0.8 }, [q.dot] = { 0.1, 0 } }
  for _, gains in ipairs { { 5, 5 }, { 5, 3 }, { 3, 5 }, { gain, gain } } do
    local low = pendulum:reduce("baumgarte", { alpha = gains[1], beta = gains[2] })
    local off = low:init { fix = start, consistent = false }
    local sol = low:integrate { start = off, to = 1, rtol = 1e-10, atol = 1e-10,
      params = gains[1] == gain and { gain = 2 } or nil }
    local drift = sol:drift()
    expect(drift[1].line):near(sol(C, 1), 1e-9)
    expect(drift[1].numerical < 1e-9):is_true()
    expect(drift[1].verdict):equals "inconsistent start"
    expect(tostring(drift)):matches "imposes C″ %+ 2α C′ %+ β² C = 0, so C decays"
  end
  local y, z, w, x = vars "y z w x"
  local chains = { { der(x) ~ z }, { der(x) ~ y, der(y) ~ z }, { der(x) ~ y, der(y) ~ w, der(w) ~ z } }
  for k, chain in ipairs(chains) do
    chain[#chain + 1] = 0 ~ x - sin(t)
    local values = { { x = 0.1 }, { x = 0.1, y = 1.3 }, { x = 0.1, y = 1.3, w = -0.2 } }
    local low = dae(chain):reduce("baumgarte", { alpha = 2 })
    local off = low:init { fix = values[k], consistent = false }
    local sol = low:integrate { start = off, to = 1, rtol = 1e-10, atol = 1e-10 }
    expect(sol:drift()[1].line):near(sol(x - sin(t), 1), 1e-9)
    expect(sol:drift()[1].verdict):equals "inconsistent start"
  end
  local projected = pendulum:reduce "project"
  local off = projected:init { fix = start, consistent = false }
  local drift = projected:integrate { start = off, to = 1, rtol = 1e-9, atol = 1e-9 }:drift()
  expect(drift.verdict):equals "inconsistent start"
  expect(tostring(drift)):matches "from the first step on the constraint is kept"
  start = { [q] = { 0.6, -0.8 }, [q.dot] = { 0, 0 } }
  local kept = pendulum:reduce "baumgarte":integrate { start = start, to = 2 }
  expect(kept:drift()[1].verdict):equals "kept"
end)

test("Rosenbrock methods choose their steps, and say what works instead", function()
  local decay = dae { der(x) ~ -x }
  local request = { start = { x = 1 }, to = 1, dt = 0.1, method = rosenbrock.rodas4 }
  expect(function() decay:integrate(request) end)
    :fails "to converge rtol = { 1e-4, 1e-6 }; a method with fixed steps is rk.radau(3)"
  expect(function() return rosenbrock.rodas4:verify() end):fails "are in method:report()"
end)
