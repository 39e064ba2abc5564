-- Whatever has an index can be started, reduced and integrated; numbers are taken as typed; singular points,
-- regions and contradictions are named where they are proved. Every answer is derived by hand.
local x, y, z, u, v, w, la = vars "x y z u v w la"

local function has(value, words)
  expect(tostring(value):find(words, 1, true) and words or tostring(value)):equals(words)
end
local function answers(sys, index, dof)
  expect(("index %d, dof %d"):format(sys:index(), sys:dof())):equals(("index %d, dof %d"):format(index, dof))
end

-- ── decimals as typed ────────────────────────────────────────────────────────────────────────────

test("small decimals are exact: capacitances that add up to a singular matrix, in every unit", function()
  for _, s in ipairs { 1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e9 } do
    -- rows and columns of the capacitance matrix [3 -1 -2; -1 1 0; -2 0 2] add up to 0: one condition
    answers(dae { 3*s*der(x) - s*der(y) - 2*s*der(z) ~ -x, -s*der(x) + s*der(y) ~ 1 - y,
      -2*s*der(x) + 2*s*der(z) ~ -z }, 1, 2)
  end
  answers(dae { 3e-9*der(x) - 1e-9*der(y) - 2e-9*der(z) ~ -x, -1e-9*der(x) + 1e-9*der(y) ~ 1 - y,
    -2e-9*der(x) + 2e-9*der(z) ~ -z }, 1, 2)
end)

test("a perfect transformer has a singular inductance matrix: 4·9 = 6², in every unit", function()
  for _, s in ipairs { 1, 1e-3, 1e-6, 1e-9, 1e-12 } do
    answers(dae { 4*s*der(x) + 6*s*der(y) ~ sin(t) - x, 6*s*der(x) + 9*s*der(y) ~ -y }, 1, 1)
  end
  local a, b = params "a=4e-9 b=9e-9"
  answers(dae { a*der(x) + 6e-9*der(y) ~ sin(t) - x, 6e-9*der(x) + b*der(y) ~ -y }, 1, 1)
end)

test("a sum made in Lua is the decimal that was meant: 0.1 + 0.2 = 0.3", function()
  answers(dae { der(x) ~ z + x, 0 ~ x + (0.1 + 0.2)*z - 0.3*z - sin(t) }, 2, 0)
end)

test("coefficients of the size of rounding errors are said, with both answers", function()
  local sys = dae { der(x) ~ z + x, 0 ~ x + (0.1 + 0.2 - 0.3)*z - sin(t) }
  has(sys:structure(), "near-singular: 5.55e-17 in (2) has the size of a rounding error; as given: "
    .. "index 1, 1 free initial value, with 0 in its place: index 2, 0 free initial values")
  local root = math.sqrt(2)
  has(dae { der(x) ~ z + x, 0 ~ x + (root^2 - 2)*z - sin(t) }:structure(), "with 0 in its place: index 2")
  local plain = dae { der(x) ~ z + x, 0 ~ x + 1e-3*z - sin(t) }
  expect(tostring(plain:structure()):find "near%-singular"):equals(nil)
end)

test("pivots that are lost in rounding are said, with both answers", function()
  has(dae { der(x) + der(y) ~ -x, der(x) + 1.0000000000001*der(y) ~ y }:structure(),
    "near-singular: the pivots of the system Jacobian differ by more than")
  -- A pan that boils at constant pressure: at a temperature near 1, exp(-3000/T) is 0, and so is a pivot.
  local M, part, V, T = vars "M part V T"
  local light, heavy = exp(10 - 3000/T), exp(9 - 3200/T)
  local pan = dae { der(M) ~ -V, der(part) ~ part*(1 - light)*V/M, 0 ~ 1 - part*light - (1 - part)*heavy,
    0 ~ V*(1 + part/10) - T/15000 + 0.3*der(T) }
  expect(tostring(pan:structure()):find "near%-singular"):equals(nil)
end)

-- ── points of degenerate sets ────────────────────────────────────────────────────────────────────

test("y³ = u in disguise: index 1 where y ≠ 0; points with y = 0 do not count", function()
  -- (1) - (2): y³ = x + z = u, and d/dt of that gives y′ = -y/3
  answers(dae { der(x) + der(y) ~ x + z, der(x) + der(y) ~ y^3, z + x ~ u, der(u) ~ -u }, 1, 2)
  answers(dae { der(x) + der(y) ~ x + z, der(x) + der(y) ~ y^5, z + x ~ u, der(u) ~ -u }, 1, 2)
  answers(dae { der(x) + der(y) ~ x + z, der(x) + der(y) ~ y^2, z + x ~ u, der(u) ~ -u }, 1, 2)
end)

-- ── start and integration from the derivative array ──────────────────────────────────────────────

local function follows(sys, request, exact, to, form)
  local low = form and sys:reduce(form) or sys:reduce()
  expect(low.form):equals(form or "array")
  local from = request.from or 0
  local start = low:init(request)
  local sol = low:integrate { start = start, from = from, to = to or from + 1, rtol = 1e-8, atol = 1e-10 }
  expect(sol.status):equals "finished"
  for leaf, f in pairs(exact) do
    local got, wanted = sol(leaf)[#sol.t], f(sol.t[#sol.t])
    local good = math.abs(got - wanted) < 1e-5
    expect(good and "exact" or ("%s = %g, not %g"):format(leaf, got, wanted)):equals "exact"
  end
  return low
end
local function zero() return 0 end

test("two rows that give x′, one of which has to be differentiated: y = 0, x = e^t, z = y′ = 0", function()
  local sys = dae { der(x) ~ x - y, der(x) ~ x, z ~ der(y) }
  answers(sys, 2, 1)
  has(sys:init { fix = { x = 1 } }, "1 free initial value")
  local exact = { [x] = math.exp, [y] = zero, [z] = zero }
  for _, form in ipairs { "acc", "project", "baumgarte", "dummy", "ode" } do
    follows(sys, { fix = { x = 1 } }, exact, 1, form)
  end
  local low = follows(sys, { fix = { x = 1 } }, exact, 1, "array")
  expect(low:index()):equals(1)
  has(low:trace(), "array: the index is 2")
end)

test("nonlinear models whose Jacobian is singular on the solutions", function()
  follows(dae { der(x) ~ z, 0 ~ y*z + x, 0 ~ y }, {}, { [x] = zero, [y] = zero, [z] = zero })
  follows(dae { der(x) ~ y, y*(der(x) - y) ~ x - sin(t) }, {}, { [x] = math.sin, [y] = math.cos })
  follows(dae { der(x) ~ 2*z - 1, 0 ~ x*(2*z^2 + 1) }, {}, { [x] = zero, [z] = function() return 0.5 end })
end)

test("an implicit ODE in form that is a DAE on its solutions", function()
  local sys = dae { der(x) + u + x + y ~ 0, u + y + der(y)*(der(x) + u + x + y) + u^2 ~ 0, u ~ sin(t) }
  answers(sys, 1, 1)
  local input_u = input "iu"
  local first = der(x) + input_u + x + y
  local forced = dae { first ~ 0, input_u + y + der(y)*first + input_u^2 ~ 0 }
  has(forced, "fully implicit DAE, 2 differential variables, index 1, 1 free initial value")
  has(forced, "singular where the equations hold: a DAE")
  -- y = -u - u², x′ = -u - x - y = u² - x
  has(sys:init { fix = { x = 1 }, from = 1 }, "consistent start")
end)

-- ── singular starts ──────────────────────────────────────────────────────────────────────────────

test("a start at a singular point is refused, with the values that continue smoothly", function()
  local sys = dae { t*der(x) ~ -x + 2*t }                     -- x = t + c/t: only c = 0 passes t = 0
  for _, request in ipairs { { fix = { x = 0, [x.dot] = 0 } }, { fix = { x = 0 } }, { guess = { x = 0 } } } do
    expect(function() sys:init(request) end):fails "the start lies on a singular point (t = 0)"
    expect(function() sys:init(request) end):fails "The solution that continues smoothly has x′ = 1."
  end
  has(sys:init { from = 1, fix = { x = 1 } }, "consistent start at t = 1")
  expect(function() dae { 0 ~ t*x + x + y, 0 ~ x + y }:init { guess = { x = 0.5 } } end)
    :fails "the start lies on a singular point (t = 0)"
end)

test("a run that stops at a singular point says how solutions go on there", function()
  local function stops(words, sys, at, method)
    at.method, at.to = method, 3
    at.start = sys:init { fix = at.fix, guess = at.guess }
    at.fix, at.guess = nil, nil
    has(sys:integrate(at).status, words)
  end
  local fold = dae { der(x)^2 ~ 1 - x^2 }                     -- x = sin t, or x = 1 from then on
  for _, method in ipairs { "auto", "dopri5", "radau" } do
    stops("solutions go on there with x″ = -1 or x″ = 0", fold, { fix = { x = 0 }, guess = { [x.dot] = 1 } },
      method)
  end
end)

test("a branch that leaves unknowns open is no start", function()
  -- on y = 0, z is free and x = y - z - z′ whatever z does
  local sys = dae { der(y) + y ~ 0, y*z ~ 0, der(z) ~ y - x - z }
  expect(function() sys:init { guess = { y = 0, z = 0.9 } } end):fails "The equations are singular here"
  expect(function() sys:init { fix = { [z.dot] = 0 }, guess = { y = 0, z = 0.9 } } end)
    :fails "the start lies on a singular point"
end)

-- ── regions ──────────────────────────────────────────────────────────────────────────────────────

test("the region that is active at the start decides", function()
  local sys = dae { der(x) ~ z, 0 ~ ifelse(lt(t, 1), z - 1, x - sin(t)) }
  local before = sys:init { from = 0, fix = { x = 3 } }       -- z = 1, x free
  expect(before(z)):near(1, 1e-12)
  local after = sys:init { from = 2 }                         -- x = sin t, z = cos t
  expect(math.abs(after(x) - math.sin(2)) < 1e-12):equals(true)
  expect(math.abs(after(z) - math.cos(2)) < 1e-12):equals(true)
  expect(function() sys:init { from = 2, fix = { z = 5 } } end):fails "z = 5"
end)

-- ── certificates ─────────────────────────────────────────────────────────────────────────────────

test("fixed values that contradict", function()
  local circle = dae { der(x) ~ -x, 0 ~ x^2 + y^2 - 1 }
  expect(function() circle:init { fix = { x = 2 } } end):fails "contradict"    -- 3 + y² is 0 for no y
  local linear = dae { der(x) ~ z - x, 0 ~ x - 2*z }
  expect(function() linear:init { fix = { x = 1, z = 1 } } end):fails "contradict"
end)

local function pendula(unit)
  local X, Y, Z = vars "X Y Z"
  local k = unit or 1
  return dae { der(x, 2) + x*la ~ 0, der(y, 2) + y*la - k ~ 0, x^2 + y^2 - k^2 ~ 0, der(X, 2) + X*Z ~ 0,
    der(Y, 2) + Y*Z - k ~ 0, X^2 + Y^2 - k^2*(1 + 0.1*la)^2 ~ 0 }, X, Y
end

test("what is not proved is no contradiction: two pendula, with the first at its right-most point", function()
  for _, k in ipairs { 1, 1e-3, 1e3 } do
    local sys, X, Y = pendula(k)                              -- y = 0, y′ is free, la = (y′)² ≥ 1
    expect(function() sys:init { fix = { x = k, [x.dot] = 0, [X] = 1.1*k } } end)
      :fails "2 initial values are neither fixed nor determined"
    local at = sys:init { fix = { x = k, [x.dot] = 0, [X] = 1.1*k, [Y] = 0, [Y.dot] = 0 } }
    expect(math.abs(at(la) - 1) < 1e-9):equals(true)
  end
end)

test("contradictions are proved by intervals and elimination; else they are not claimed", function()
  local function refused(words, sys, fix) expect(function() sys:init { fix = fix } end):fails(words) end
  for _, g in ipairs { exp(z) + x, sin(z) + x, sqrt(z) + x, log(z^2 + 1) + x, z^2 - 2*z + x, z^4 - 3*z + x,
    abs(z) + x, max(z, 1) + x } do
    refused("contradict", dae { der(x) ~ z - x, 0 ~ g }, { x = 3 })
  end
  refused("contradict", dae { der(x) ~ z - x, 0 ~ z + u - x, 0 ~ z + u + 1 - 2*x + v, 0 ~ v - 1 }, { x = 3 })
  refused("that there is none is not proved", dae { der(x) ~ z, 0 ~ sin(z)*cos(z) + x }, { x = 0.9 })
end)

test("inputs are suggested where they lead to a solution", function()
  expect(function() dae { der(y) ~ u + v, der(x) ~ u + v, 0 ~ x - y }:index() end)
    :fails "Add an equation; no unknown was found that could be an input instead."
  expect(function() dae { der(x) ~ u + v - x, 0 ~ u - x }:index() end)
    :fails "let one of the unknowns be given: "
end)

-- ── units ────────────────────────────────────────────────────────────────────────────────────────

test("the index does not depend on the size of the constraint set", function()
  local models = {
    { 2, function(r) return dae { der(x) ~ z, 0 ~ x^2 + y^2 - r^2, der(y) ~ -x } end },    -- x = 0: index 3
    { 2, function(r) return dae { der(x) ~ z, 0 ~ x*y - r^2, der(y) ~ -x } end },
    { 2, function(r) return dae { der(x) ~ z, 0 ~ x^3 + y^3 - r^3, der(y) ~ -x } end },
    { 2, function(r)
      return dae { der(x) ~ y, der(y) ~ u, der(z) ~ v, 0 ~ x^2 + y^2 + z^2 - r^2, v ~ -x }
    end },
    { 3, function(r)
      return dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81*r, 0 ~ x^2 + y^2 - r^2 }
    end },
  }
  for _, m in ipairs(models) do
    for _, r in ipairs { 1e-12, 1e-9, 1e-6, 1e-5, 1e-3, 0.02, 1, 50, 1e3, 1e6, 1e9 } do
      expect(m[2](r):index()):equals(m[1])
    end
  end
end)

-- Lane-Emden's and Bessel's equations, and flow in a pipe, as people write them: x″ + k x′/t + …
test("quotients that are 0/0 at the start", function()
  local x, v = var "x", var "v"
  local function refused(equations, start, words)
    local run = { start = start, to = 1 }
    expect(function() dae(equations):integrate(run) end):fails(words)
  end
  refused({ der(x) ~ v, der(v) ~ -2*v/t - x^5 }, { x = 1, v = 0 }, "smoothly has x′ = 0, v′ = -0.333333")
  refused({ der(x, 2) ~ -der(x)/t - x }, { x = 1, [der(x)] = 0 }, "smoothly has x″ = -0.5")
  refused({ der(x) ~ sin(t)/t }, { x = 0 }, "x′ = 1")
  refused({ der(x) ~ v, der(v) ~ -v/t + x/t^2 }, { x = 0, v = 3 }, "x′ = 3")
  refused({ der(x) ~ 1/t }, { x = 0 }, "1/t is undefined; ")       -- no solution through it
  refused({ der(x) ~ v, der(v) ~ -2*v/t }, { x = 1, v = 1 }, "is undefined; ")
end)

test("a model without freedom needs no start", function()
  local x, F = var "x", var "F"
  local driven = dae { 2*der(x, 2) ~ F - 10*x, 0 ~ x - sin(t)^2 }
  local sol = driven:reduce():integrate { to = 3 }
  expect(sol(F, 3)):near(4*math.cos(6) + 10*math.sin(3)^2, 1e-5)
  expect(function() dae { der(x) ~ -x } :integrate { to = 3 } end):fails "needs a start"
end)
