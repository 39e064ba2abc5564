-- sys:pencil() from Lua: the exam, the lecture, options and errors.
local X = var("x", 3)
local exam = dae { mat { { 1, 1, 0 }, { 0, 0, 1 }, { 1, 1, 1 } } * der(X) ~ X }

test("exam 3(d)", function()
  local p = exam:pencil()
  expect(p.regular):equals(true)
  expect(p.index):equals(2)
  expect(p.dof):equals(1)
  expect(tostring(p.det)):equals "2 s - 1"
  expect(tostring(p.modes[1].re)):equals "1/2"
  expect(#p.constraints):equals(2)
  expect(tostring(p.basis)):equals "(1, 1, 2)"
  expect(tostring(p)):matches "0 = x₁ %- x₂"
  expect(p:shuffle()):matches "%(d%) %- %(a%) %+ %(b%):"
  local alpha = param "alpha"
  expect(tostring(p:solution { x1 = alpha })):equals "(α exp(t/2), α exp(t/2), 2 α exp(t/2))"
  expect(tostring(p:solution { 1, 1, 2 })):equals "(exp(t/2), exp(t/2), 2 exp(t/2))"
  expect(function() p:solution { 1, 2, 3 } end):fails "x0 is not consistent: 0 ≠ -1 = x₁ - x₂"
  expect(function() p:solution { 1, 2 } end):fails "x0 has 2 entries for 3 unknowns"
  expect(function() p:solution { x1 = t } end):fails "must not depend on t"
end)

test("inputs", function()
  local x, y, u = var "x", var "y", input "u"
  local p = dae { der(x) ~ y, 0 ~ x - y + u }:pencil()
  local s = p:solution({ x = 1 }, { inputs = { [u] = sin(t) } })
  expect(evaluate(s, { t = 0 })[1]):equals(1)
  expect(tostring(p:solution({ x = 0 }, { inputs = { [u] = function(t)
    return exp(t) end } })[1])):equals "t exp(t)"
  expect(function() p:solution { x = 1 } end):fails "the input 'u' needs an expression in t"
  expect(function() p:solution({ x = 1 }, {
    inputs = { u = tanh(t) } }) end):fails "tanh(t) is not a polynomial"
  expect(function() p:solution({ x = 1 }, { input = {} }) end):fails "Did you mean 'inputs'?"
end)

test("what has no pencil", function()
  local x, y = var "x", var "y"
  expect(function() dae { der(x) ~ y ^ 2,
    0 ~ x + y }:pencil() end):fails "equation (1) 'x′ = y²' is not linear"
  local p = dae { der(x) ~ y, 2 * der(x) ~ 2 * y }:pencil()
  expect(p.regular):equals(false)
  expect(function() return p.index end):fails "the pencil is singular and has no index"
  expect(tostring(p)):matches "one equation too many, no contradiction"
end)

test("det(sE - A) in symbols is that of the pencil with numbers in place of them", function()
  local x, y, z, w = vars "x y z w"
  local a, b, c, s = params "a b c s"
  local models = {
    { der(x) ~ y, a*der(y) ~ -x - b*y, "ab" },
    { a*der(x) ~ y, b*der(y) ~ -x + c*z, 0 ~ x + a*y - z, "abc" },
    { der(x, 2) ~ -a*x + b*(y - x), c*der(y, 2) ~ -b*(y - x), "abc" },
    { a*der(x) + b*der(y) ~ -x, c*der(x) + der(y) ~ y, "abc" },
    { der(x) ~ y + a*w, der(y) ~ z, b*der(z) + c*der(w) ~ x, 0 ~ x - a*w, "abc" },
  }
  for _, equations in ipairs(models) do
    local names = table.remove(equations)
    local sys = dae(equations)
    local polynomial, coefficients = sys:characteristic()
    for _, set in ipairs { { a = 2, b = 3, c = 5 }, { a = 1, b = 1, c = 1 }, { a = 0, b = 2, c = 1 } } do
      local numbers, values = { [a] = set.a, [b] = set.b, [c] = set.c }, {}
      for name in names:gmatch "." do values[name] = set[name] end
      local there = subs(polynomial, numbers)
      local by_numbers = sys:with(values):pencil()
      local same = simplify(there - by_numbers.det) == 0 or simplify(there + by_numbers.det) == 0
      expect(same):equals(true)
      if by_numbers.regular and subs(coefficients[#coefficients] + 0*a, numbers) ~= 0 then
        expect(by_numbers.dof):equals(#coefficients - 1)
      end
    end
  end
  expect(function() dae { der(x) ~ -x^2 }:characteristic() end):fails "that of x is 2 x"
end)

test("a pencil with symbols: determinant, and the values for which index and freedom differ", function()
  local x, y, z, w = vars "x y z w"
  local eps, k, a1, a5 = params "eps k a1 a5"
  local sys = dae { der(x) ~ y, eps*der(y) ~ z - x, 0 ~ x - sin(t) + k*z }
  local p = sys:pencil()
  expect(tostring(p.det)):equals(tostring((sys:characteristic())))
  expect(p.index):equals(1)
  expect(p.dof):equals(2)
  for _, words in ipairs { "for almost all values of the parameters: index 1, 2 free initial values",
    "for eps = 0: index 2, 0 free initial values", "for k = 0: index 3, 0 free initial values" } do
    expect(tostring(p):find(words, 1, true) ~= nil):equals(true)
  end
  expect(function() return p.modes end):fails "sys:with{"
  expect(sys:with{ eps = 2, k = 1 }:pencil().dof):equals(2)            -- numbers: as before
  -- also where the model has values that are not the exceptional ones
  local valued = tostring(sys:with{ eps = 2, k = 1 }:structure())
  expect(valued:find("for eps = 0: index 2", 1, true) ~= nil):equals(true)
  expect(valued:find("for k = 0: index 3", 1, true) ~= nil):equals(true)
  -- a factor of two parameters, and a structure that fails
  local two = dae { der(x) + a1*der(y) ~ z, der(x) + a5*der(y) ~ w - x, 0 ~ x + y - z, 0 ~ x + a1*y - w }
  local cases = tostring(two:structure())
  expect((cases:find("for a₁ = a₅: ", 1, true) or cases:find("for a₅ = a₁: ", 1, true)) ~= nil):equals(true)
  local fails = dae { der(x) + der(y) ~ a1*z, der(x) + der(y) ~ a5*y, 0 ~ x - w, z ~ k*w }
  expect(tostring(fails:structure()):find("for a₁ = ", 1, true) ~= nil
    or tostring(fails:structure()):find("for k = ", 1, true) ~= nil
    or tostring(fails:structure()):find("for a₅ = ", 1, true) ~= nil):equals(true)
end)

test("a pencil with symbols: the values for which two factors vanish", function()
  local x, y = vars "x y"
  local a, b, c = params "a b c"
  local function cases(sys) return tostring(sys:pencil()):gsub(".-free initial values?\n", "", 1) end
  -- det = s² (a - b) + s (a - 1) - 1, worked by hand: the next coefficient leads where the first is gone
  expect(cases(dae { a*der(x) + der(y) ~ x, b*der(x) + der(y) ~ -y })):equals(
    "for a = b: index 1, 1 free initial value\nfor a = 1 and b = 1: index 2, 0 free initial values")
  expect(cases(dae { a*der(x) + b*y ~ x, c*der(x) + der(y) ~ -y })):equals(
    "for a = 0: index 1, 1 free initial value\nfor a = 0 and b = -1/c: index 2, 0 free initial values")
  -- each of two factors, and both, in whichever order they are found
  expect(cases(dae { a*der(x) ~ y, b*der(y) ~ x + y })):equals(
    "for a = 0: index 2, 0 free initial values\nfor b = 0: index 1, 1 free initial value\n"
    .. "for a = 0 and b = 0: index 1, 0 free initial values")
  -- no such values: a = 1/b has none where b = 0, and x/a none at a = 0
  expect(cases(dae { (a*b - 1)*der(x) + b*x + y ~ 0, -x + der(y) ~ 0 })):equals(
    "for a = 1/b: index 1, 1 free initial value")
  expect(cases(dae { a*der(x) ~ x/a + y, 0 ~ y - x })):matches "for a = 0: no index"
  -- what two say together agrees with the numbers put in
  expect(dae { a*der(x) + der(y) ~ x, b*der(x) + der(y) ~ -y }:with{ a = 1, b = 1 }:index()):equals(2)
  expect(dae { a*der(x) + b*y ~ x, c*der(x) + der(y) ~ -y }:with{ a = 0, b = -1/2, c = 2 }:index()):equals(2)
end)

test("a start by init, consistent to rounding, is one of a pencil", function()
  local x, y = vars "x y"
  local sys = dae { der(x) ~ -x + y, 0 ~ x - 3*y }
  for _, x0 in ipairs { 0.1, 1/7, 1e-9/3, 1e7/3 } do
    local at = sys:init { fix = { x = x0 } }
    local exact = sys:pencil():solution { [x] = at(x), [y] = at(y) }
    expect(evaluate(exact[1], { t = 1 })):near(x0*math.exp(-2/3), 1e-9*x0)
  end
  expect(function() sys:pencil():solution { [x] = 0.1, [y] = 0.0333333 } end):fails "not consistent"
end)
