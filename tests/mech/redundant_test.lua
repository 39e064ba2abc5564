-- Linkages whose constraints depend on each other wherever they move.

-- A parallelogram with a third crank: cranks of length L at 0, D, 2 D, one coupler. It moves as one crank
-- does: all angles are equal, the coupler stays level, 2 L² a″ = -14.715 L cos a.
local function parallelogram(L, D, name)
  local q = var(name, 4)
  local function pin(k, a) return k * D + L * cos(a), L * sin(a) end
  local x1, y1 = pin(0, q[1])
  local x2, y2 = pin(1, q[2])
  local x3, y3 = pin(2, q[3])
  local b = q[4]
  local C = { x1 + D*cos(b) - x2, y1 + D*sin(b) - y2, x1 + 2*D*cos(b) - x3, y1 + 2*D*sin(b) - y3 }
  local T = L^2*(q[1].dot^2 + q[2].dot^2 + q[3].dot^2)/6 + D^2*b.dot^2/3 + L^2*q[1].dot^2/2
  return lagrange { q = q, T = T, V = 9.81*(y1 + y2 + y3)/2, C = C }, q
end

local function near(q) return { [q[2]] = 1, [q[3]] = 1, [q[4]] = 0 } end

test("a third crank: index, degrees of freedom and every form, in any unit of length", function()
  for _, lengths in ipairs { { 1, 2 }, { 1, 3 }, { 1e-3, 2e-3 }, { 10, 20 }, { 1e3, 3e3 } } do
    local L, D = lengths[1], lengths[2]
    local given, q = parallelogram(L, D, "angle")
    local linkage = given:independent { fix = { [q[1]] = 1 }, guess = near(q) }
    expect(linkage:index()):equals(3)
    expect(linkage:dof()):equals(2)
    local a, to = var "alpha", 0.3 * math.sqrt(L)
    local wanted = dae { der(a, 2) ~ -14.715*cos(a)/(2*L) }
      :integrate { start = { alpha = 1, [a.dot] = 0 }, to = to, rtol = 1e-10, atol = 1e-12 }(a, to)
    local start = linkage:init { fix = { [q[1]] = 1, [q[1].dot] = 0 }, guess = near(q) }
    for _, form in ipairs { "acc", "project", "baumgarte", "ggl", "dummy", "ode" } do
      local sol = linkage:reduce(form):integrate { start = start, to = to, rtol = 1e-9, atol = 1e-10 }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      expect(math.abs(sol(q[1], to) - wanted) < 1e-8):equals(true)
      expect(math.abs(sol(q[4], to)) < 1e-8):equals(true)
    end
    -- multipliers of least norm have no share in what (∂C/∂q)ᵀ cannot feel: the null vector of its columns
    local z, s, c = given.multipliers, math.sin(1), math.cos(1)
    local null = { 2*c/s, 2, -c/s, -1 }
    local share, size = 0, 0
    for k = 1, 4 do
      share = share + null[k] * start(z[k])
      size = size + math.abs(null[k] * start(z[k]))
    end
    expect(math.abs(share) <= 1e-9 * size):equals(true)
  end
end)

-- Rows that were chosen where the linkage is another one may have solutions at the start that it has not.
test("form array of another point is right or says where it has to be made", function()
  local given, q = parallelogram(1, 3, "angle")
  local linkage = given:independent { fix = { [q[1]] = 1 }, guess = near(q) }
  local start = linkage:init { fix = { [q[1]] = 1, [q[1].dot] = 0 }, guess = near(q) }
  local function final(low)
    local sol = low:integrate { start = start, to = 0.1, rtol = 1e-9, atol = 1e-11 }
    expect(sol.status):equals "finished"
    return sol:final(q[1])
  end
  local there = final(linkage:reduce("array", { at = start }))
  expect(there):near(0.980021134466, 1e-9)
  local ok, elsewhere = pcall(final, linkage:reduce "array")
  if ok then
    expect(elsewhere):near(there, 1e-9)
  else
    expect(elsewhere):matches 'make it there: reduce%("array", { at = start }%)'
  end
end)

test("parameters keep their values", function()
  local q, L = var("angle", 4), param("length", 1)
  local C = { L*cos(q[1]) + 2*cos(q[4]) - 2 - L*cos(q[2]), L*sin(q[1]) + 2*sin(q[4]) - L*sin(q[2]),
    L*cos(q[1]) + 4*cos(q[4]) - 4 - L*cos(q[3]), L*sin(q[1]) + 4*sin(q[4]) - L*sin(q[3]) }
  local given = lagrange { q = q, T = dot(q.dot, q.dot)/2, V = 9.81*sin(q[1]), C = C }
  local linkage = given:with{ length = 0.5 }:independent { fix = { [q[1]] = 1 }, guess = near(q) }
  expect(linkage.values[L]):equals(0.5)
  expect(linkage:dof()):equals(2)
end)

test("a start names the remedy, and what is no redundancy is refused", function()
  local given, q = parallelogram(1, 2, "angle")
  local C, z = given.C, var("force", 4)
  local typed = dae { given.M*q.ddot ~ given.rhs - given.dCdq.T*z, 0 ~ C }
  expect(function() typed:init { fix = { [q[1]] = 1, [q[1].dot] = 0 }, guess = near(q) } end)
    :fails "sys:independent{"
  expect(function() typed:index() end):fails
    "where nothing moves it is 3; where the mechanism moves, the constraints (2a), (2b), (2c), (2d) follow"
  local x, y = vars "x y"
  local pendulum = lagrange { q = vec{x, y}, T = (x.dot^2 + y.dot^2)/2, V = y, C = { x^2 + y^2 - 1 } }
  expect(function() pendulum:independent { guess = { x = 0.6, y = 0.8 } } end):fails
    "the gradients of the 1 constraints are independent"
  expect(function() given:independent { guess = { [q[1]] = 0, [q[2]] = 0, [q[3]] = 0, [q[4]] = 0 } } end)
    :fails "singular"
  for _, equation in ipairs { 0 ~ x - y, der(y) ~ -x } do
    expect(function() dae { der(x) ~ y, equation }:independent{} end)
      :fails "expected a model made by lagrange"
  end
  local w = var "w"
  local nonlinear = dae { der(x, 2) ~ -2*x*(y + exp(w)), 0 ~ x^2 - 1, 0 ~ x^4 - 1 }
  expect(function() nonlinear:independent { guess = { x = 1 } } end):fails
    "'w' enters the equations nonlinearly"
end)

-- Two cranks of one pivot and a guide: of their five constraints four are independent wherever they are.
local x, y, a, b, c = vars "x_cr y_cr a_cr b_cr c_cr"
local function cranks(L, order, check)
  local all = { x - L*sin(a), y + L*cos(a), x - L*sin(b), y + L*cos(b), x - L*sin(c) }
  local C = {}
  for k, i in ipairs(order) do C[k] = all[i] end
  local given = lagrange { q = { x, y, a, b, c }, T = (x.dot^2 + y.dot^2)/2, V = 9.81*y, C = C }
  local near = { fix = { [a] = 1, [a.dot] = 0 },
    guess = { [x] = L*math.sin(1), [y] = -L*math.cos(1), [b] = 1, [c] = 1 } }
  local linkage = given:independent(near)
  local start = linkage:init(near)
  for _, form in ipairs { "acc", "project", "baumgarte" } do
    for _, method in ipairs { "dopri5", "radau" } do
      check(linkage:reduce(form):integrate { start = start, to = math.sqrt(L), rtol = 1e-8, atol = 1e-10*L,
        method = method, max_steps = 5000 })
    end
  end
end

test("a run goes on with other constraints where those chosen allow what the others do not", function()
  -- those of y determine neither crank at a = 0, and let b go on to -a
  local exact = dae { der(a, 2) ~ -9.81*sin(a) }:integrate {
    start = { [a] = 1, [a.dot] = 0 }, to = 1, rtol = 1e-10 }
  for _, L in ipairs { 1, 1e-3 } do
    cranks(L, { 2, 4, 5, 1, 3 }, function(sol)
      expect(sol.status):equals "finished"
      expect(sol:final(a)):near(exact(a, 1), 1e-6)
      expect(sol:final(b)):near(exact(a, 1), 1e-6)
    end)
  end
end)

test("chosen constraints that stay independent: a pendulum of all three angles", function()
  local u = var "u"
  local pendulum = dae { der(u, 2) ~ -9.81*sin(u) }:integrate {
    start = { u = 1, [u.dot] = 0 }, to = 1, rtol = 1e-11 }
  for _, L in ipairs { 1, 1e-3 } do
    cranks(L, { 1, 2, 3, 4, 5 }, function(sol)
      expect(sol.status):equals "finished"
      for _, angle in ipairs { a, b, c } do expect(sol:final(angle)):near(pendulum:final(u), 1e-7) end
    end)
  end
end)
-- A constraint written twice, a multiple or a sum of others: the same motion, and forces of least norm.
test("constraints that follow from others", function()
  local x, y, w, L = var "x", var "y", var "w", param("L", 3)
  local g, h = x^2 + y^2 - 1, w - x
  local function model(C)
    return lagrange { q = vec{x, y, w}, T = (x.dot^2 + y.dot^2 + w.dot^2)/2, V = 9.81*y, C = C }
  end
  local request = { fix = { [y] = 0, [y.dot] = 0.5 }, guess = { x = 1, w = 1 } }
  local plain = model { g, h }
  local a = plain:init(request)
  local wanted = plain:reduce():integrate { start = a, to = 1, rtol = 1e-11 }(y, 1)
  local z = plain.multipliers
  local cases = {             -- C; each z of least norm as a share of which multiplier of the plain model
    { { g, h, g }, { 1/2, 1, 1/2 }, { 1, 2, 1 } },
    { { g, h, 2*g }, { 1/5, 1, 2/5 }, { 1, 2, 1 } },
    { { L*g, g, h }, { 3/10, 1/10, 1 }, { 1, 1, 2 } },
    { { g, (x + y)^2 - 2*x*y - 1, h }, { 1/2, 1/2, 1 }, { 1, 1, 2 } },
  }
  for _, case in ipairs(cases) do
    local twice = model(case[1])
    expect(twice:index()):equals(3)
    expect(twice:dof()):equals(2)
    local start = twice:init(request)
    for k, share in ipairs(case[2]) do
      expect(start(twice.multipliers[k])):near(share * a(z[case[3][k]]), 1e-9)
    end
    for _, form in ipairs { "acc", "ggl", "baumgarte", "project", "dummy", "ode", "array" } do
      local low = twice:reduce(form, form == "array" and { at = start } or nil)
      local sol = low:integrate { start = start, to = 1, rtol = 1e-10, atol = 1e-12 }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      expect(math.abs(sol(y, 1) - wanted) < 1e-7):equals(true)
    end
  end
  local sum = model { g, h, g + h }            -- z of least norm is orthogonal to (1, 1, -1)
  local start = sum:init(request)
  local m = sum.multipliers
  expect(start(m[1] + m[2] - m[3])):near(0, 1e-12)
  expect(start(m[1] + m[3])):near(a(z[1]), 1e-9)
  expect(start(m[2] + m[3])):near(a(z[2]), 1e-9)
  expect(tostring(sum)):matches "C₃ follows from C₁, C₂: z of least norm, C₃ = C₁ %+ C₂"
  expect(tostring(model { g, 2*g, h }:reduce "acc":trace())):matches "C₃′ = 0"  -- names as they were given
  expect(function() model { g, h, g + h - 1 } end):fails "contradicts C₁, C₂: together they say 0 = -1"
  expect(function() model { g, cos(g) } end):fails
    "with factors that contain coordinates, and no position that satisfies all was found"
end)

test("redundant far from the origin, and with fast drives", function()
  local x, y, a, b = vars "x_far y_far a_far b_far"
  for _, X in ipairs { 0, 1e3, 1e7 } do
    local T = (x.dot^2 + y.dot^2)/2 + (a.dot^2 + b.dot^2)/100
    local given = lagrange { q = { x, y, a, b }, T = T, V = 9.81*y,
      C = { x - X - sin(a), y - X + cos(a), x - X - sin(b), (y - X)^2 + (x - X)^2 - 1 } }
    local linkage = given:independent { fix = { [a] = 1 }, guess = { [x] = X + 0.8, [y] = X - 0.5, [b] = 1 } }
    expect(linkage:index()):equals(3)
    expect(linkage:dof()):equals(2)
  end
  for _, rate in ipairs { 1e-6, 1, 1e9 } do
    local given = lagrange { q = { x, y, a }, T = (x.dot^2 + y.dot^2)/2 + a.dot^2, V = 9.81*y,
      C = { x - sin(a), y + cos(a), a - sin(rate*t), x^2 + y^2 - 1 } }
    expect(given:dof()):equals(0)
    expect(given:index()):equals(3)
  end
end)
