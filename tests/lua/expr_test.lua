-- The expression vocabulary (docs/language.md#symbols-and-expressions): every name, and every trap with its
-- text.
local x, y, z = vars "x y z"
local q = var("q", 6)
local m, g = params "m=1 g=9.81"
local k = param "k"
local u = input("u", 2)
local p1, p2 = q:slice(1, 3), q:slice(4, 6)
local A = mat{ { 1, 2 }, { 3, 4 } }

local function shows(value, text) expect(tostring(value)):equals(text) end
local function fails(f, text) expect(f):fails(text) end

-- ── symbols ──

test("symbols are the same when kind and name are the same", function()
  expect(var "x" == x):is_true()
  expect(x == y):is_false()
  expect(param "x" == x):is_false()
  expect(q[4] == p2[1]):is_true()
  expect(({ [x] = 5 })[var "x"]):equals(5)
end)

test("declarations", function()
  shows(x, "x")
  expect(#q):equals(6)
  expect(q.rows):equals(6)
  expect(q.cols):equals(1)
  expect(#u):equals(2)
  expect(m.value):equals(1)
  expect(k.value):is_nil()
  expect(param("c", "1/3").value == rational "1/3"):is_true()
  expect(param("w0", { 1, 2 })[2].value):equals(2)
  local a, b, c = params "a=1/3, b = 2 c"
  expect(evaluate(3*a + b)):equals(3)
  expect(c.value):is_nil()
  local s = var("s", { unit = "m", text = "position" })
  expect(s.unit):equals "m"
  expect(s.label):equals "position [m]"
  expect(x.dot.name):equals "x'"
  expect(q[3].name):equals "q3"
end)

test("names are checked", function()
  fails(function() var "1x" end, "'1x' is not a name")
  fails(function() var "t" end, "'t' is the independent variable")
  fails(function() params "pi=3" end, "'pi' is the number")
  fails(function() var(3) end, "bad argument #1 'name': expected a string")
  fails(function() var("x", 0) end, "the size of 'x' must be between 1 and 1000000")
  fails(function() var("x", 1e12) end, "the size of 'x'")
  fails(function() vars "" end, "expected names, as in vars")
  fails(function() params "m=a" end, "'a' is not a number")
  fails(function() param("m", x) end, "must be a number, not the expression x")
  fails(function() var("x", { units = "m" }) end, "unknown option 'units'. Did you mean 'unit'?")
  fails(function() func("g", 0) end, "the number of outputs")
  expect(m.value):equals(1)                                -- a failed declaration changes nothing
end)

test("undefined names are errors", function()
  fails(function() return xx end, "undefined variable 'xx'")
  fails(function() return jacobain end, "Did you mean 'jacobian'?")
end)

-- ── numbers ──

test("numbers stay exact", function()
  expect(x*(1/3) == x*rational "1/3"):is_true()
  expect(x*9.81 == x*rational "981/100"):is_true()
  expect("1/3"*x == x*(1/3)):is_true()
  expect(x*(5/12) == x*rational "5/12"):is_true()
  expect(rational "1/3" + rational "2/3"):equals(1)
  shows(rational "1/3", "1/3")
  expect((x - x) == 0):is_true()
  expect(diff(3*x, x) == 3):is_true()
  expect(math.type(x - x)):equals "integer"
  fails(function() return x + 0/0 end, "the right operand is nan")
  fails(function() return x + "abc" end, "'abc' is not a number")
  fails(function() return x/0 end, "division by zero")
  fails(function() return x + 1/(y - y) end, "the right operand is inf")     -- y - y is the number 0
end)

test("functions: floats give floats, integers stay exact", function()
  expect(sin(0.5)):near(math.sin(0.5), 0)
  expect(math.type(exp(-0.5))):equals "float"
  shows(sqrt(2), "√2")
  expect(sqrt(4) == 2):is_true()
  expect(evaluate(sqrt(2))):near(math.sqrt(2), 0)
  expect(sqrt(2)^2 == 2):is_true()
  expect(sqrt("1/4") == rational "1/2"):is_true()
  shows(pi, "π")
  expect(evaluate(2*pi)):near(2*math.pi, 1e-15)
  expect(linspace(0, 2*pi, 3)[3]):near(2*math.pi, 1e-15)
  expect(sqrt(2) < 3/2):is_true()
  expect(max(1, 2.5, 2)):equals(2.5)
  expect(min{ 3, 1, 2 } == 1):is_true()
  expect(atan2(1.0, 1)):near(math.pi/4, 1e-15)
  expect(abs(-3) == 3):is_true()
  fails(function() sqrt(-1) end, "sqrt(-1) has no finite real value")
  fails(function() sqrt(-1.5) end, "sqrt(-1.5) has no finite real value")
  fails(function() log(0) end, "log(0) has no finite real value")
  fails(function() sin() end, "expected 1 argument, got 0")
  fails(function() sin(1, 2) end, "expected 1 argument, got 2")
  fails(function() sin(nil) end, "not nil")
end)

test("functions on matrices work entry by entry", function()
  expect(sin(vec{ x, 0 }) == vec{ sin(x), 0 }):is_true()
  expect(sqrt(linspace(0, 4, 3))):near({ 0, math.sqrt(2), 2 }, 1e-15)
  expect(max(vec{ x, y }, 0) == vec{ max(x, 0), max(y, 0) }):is_true()
  expect(max(linspace(-1, 1, 3), 0)):equals({ 0, 0, 1 })
  fails(function() atan2(q, p1) end, "have no entries in common")
end)

test("numbers answer what scalars answer", function()
  expect((3).T):equals(3)
  expect((3)[1]):equals(3)
  expect(#(2)):equals(1)
  expect((2.5).dot):equals(0)
  expect((3):latex()):equals "3"
  fails(function() return (3).foo end, "a number has no entry 'foo'")
  fails(function() return (3)[2] end, "a number has no entry '2'")
end)

-- ── operators ──

test("arithmetic", function()
  expect(2*x + x == 3*x or simplify(2*x + x) == 3*x):is_true()
  expect(evaluate((x + 2)*(x - 2)/x^2 - -x, { x = 2 })):equals(2)
  expect(A*A == mat{ { 7, 10 }, { 15, 22 } }):is_true()
  expect(A^2 == A*A):is_true()
  expect(A^-1*A == eye(2)):is_true()
  expect(A^0 == eye(2)):is_true()
  expect(A*{ 1, 1 } == vec{ 3, 7 }):is_true()
  expect(p1.T*p1 == dot(p1, p1)):is_true()
  expect(2*p1 - p1*2 == zeros(3)):is_true()
  expect(p1*0.5 == "1/2"*p1):is_true()
  expect((p1/2)[2] == q[2]/2):is_true()
  expect(0 + p1 == p1):is_true()
  expect("v = " .. x):equals "v = x"
end)

test("shapes that do not fit say so", function()
  fails(function() return q + 1 end, "a 6×1 column and a scalar cannot be added")
  fails(function() return q + p1 end, "a 6×1 column and a 3×1 column cannot be added")
  fails(function() return q*q end, "for the inner product write a.T*b")
  fails(function() return A*p1 end, "the columns of the first must match the rows of the second")
  fails(function() return A/A end, "write solve(A, b)")
  fails(function() return 1/q end, "division by a 6×1 column")
  fails(function() return 2^A end, "expm(A)")
  fails(function() return q^2 end, "has no powers")
  fails(function() return A^0.5 end, "must be an integer")
  fails(function() return mat{ { 1, 2 }, { 2, 4 } }^-1 end, "A v = 0 for v = (2, -1)")
  fails(function() return x + nil end, "the right operand must be a number")
  fails(function() return x .. nil end, "attempt to concatenate nil")
end)

test("operators that mean nothing name the remedy", function()
  fails(function() return x < 1 end, "write lt(a, b) for a < b and gt(a, b) for a > b")
  fails(function() return 1 >= x end, "le(a, b) for a <= b and ge(a, b)")
  fails(function() return q < 1 end, "matrices have no order")
  fails(function() return x//2 end, "write a/b")
  fails(function() return x % 2 end, "expressions have no %")
  fails(function() return x & y end, "write all(a, b)")
  fails(function() return x | y end, "write any(a, b)")
  fails(function() return x << 1 end, "write lt(a, b)")
  fails(function() return ~x end, "write 0 ~ x")
  fails(function() x.dot = 3 end, "immutable")
  fails(function() return x.dott end, "Did you mean 'dot'?")
end)

test("conditions", function()
  expect(lt(1, 2)):is_true()
  expect(gt(1, 2)):is_false()
  expect(ge(2, 2)):is_true()
  expect(all(lt(1, 2), true)):is_true()
  expect(any{ lt(2, 1), lt(3, 2) }):is_false()
  local e = ifelse(all(gt(x, 0), lt(x, 1)), x, 2*x)
  expect(evaluate(e, { x = 0.5 })):equals(0.5)
  expect(evaluate(e, { x = 2 })):equals(4)
  expect(ifelse(true, "p", "q")):equals "p"
  expect(evaluate(diff(e, x), { x = 3 })):equals(2)
  expect(ifelse(lt(x, 0), p1, 0*p1) == map(p1, function(c) return ifelse(lt(x, 0), c, 0) end)):is_true()
  fails(function() ifelse(lt(x, 0), 1) end, "expected 3 arguments")
end)

-- ── equations ──

test("equations", function()
  local e = 0 ~ x^2 + y^2 - 1
  shows(e, "0 = x² + y² - 1")
  expect(e.lhs):equals(0)
  expect(e:residual() == -(x^2 + y^2 - 1)):is_true()
  expect((0 ~ p1).lhs == zeros(3)):is_true()
  expect((x ~ y) == (x ~ y)):is_true()
  expect((x ~ y) == (y ~ x)):is_false()
  expect(der(x ~ y^2) == (x.dot ~ der(y^2))):is_true()
  expect(load("local x, y = vars 'x y'; return " .. (x ~ y^2):code())() == (x ~ y^2)):is_true()
  fails(function() return x ~ y ~ z end, "an equation has one ~")
  fails(function() return p1 ~ 1 end, "the left side is a 3×1 column, the right side a scalar")
end)

-- ── derivatives ──

test("time derivatives", function()
  shows(x.dot, "x′")
  expect(x.ddot == der(x, 2)):is_true()
  expect(x.dot.dot == x.ddot):is_true()
  expect(der(sin(x)) == cos(x)*x.dot):is_true()
  expect(der(t^2) == 2*t):is_true()
  expect(der(m*g) == 0):is_true()
  expect(der(u[1]) == u.dot[1]):is_true()
  expect(q.dot[2] == q[2].dot):is_true()
  expect(simplify(der(p1.T*p1) - 2*p1.T*p1.dot) == 0):is_true()
  fails(function() der(x, -1) end, "the order of a derivative")
  fails(function() der(x, 1.5) end, "expected an integer")
end)

test("partial derivatives", function()
  expect(diff(x^3, x, 2) == 6*x):is_true()
  expect(diff(x*x.dot, x) == x.dot):is_true()
  expect(diff(x*x.dot, x.dot) == x):is_true()
  expect(diff(x^2, "x") == 2*x):is_true()
  expect(diff(vec{ x, x^2 }, x) == vec{ 1, 2*x }):is_true()
  expect(jacobian({ x*y, y }, { x, y }) == mat{ { y, x }, { 0, 1 } }):is_true()
  expect(jacobian(p1.T*p1, q) == hstack(2*p1.T, zeros(1, 3))):is_true()
  expect(jacobian(q, "q") == eye(6)):is_true()
  expect(jacobian(q[2], "q").cols):equals(6)
  expect(gradient(x*y, { x, y }) == vec{ y, x }):is_true()
  expect(hessian(x^2*y, { x, y }) == mat{ { 2*y, 2*x }, { 2*x, 0 } }):is_true()
  fails(function() jacobian(x, x^2) end, "must be a symbol, not the expression x²")
  fails(function() diff(x, q) end, "x has 6 components")
  fails(function() diff(x, 3) end, "expected a symbol")
  fails(function() diff(x, "w") end, "unknown symbol 'w'")
  fails(function() gradient(q, x) end, "e must be a scalar")
  fails(function() diff(x, nil) end, "expected a symbol")
end)

test("unspecified functions", function()
  local f = func "f"
  local h = func("h", 2)
  expect(f(x) == f(x)):is_true()
  expect(#h(x, p1)):equals(2)
  shows(f(x, z), "f(x, z)")
  shows(diff(f(x, z), x), "∂f/∂x")
  expect(der(f(x)) == diff(f(x), x)*x.dot):is_true()
  expect(jacobian(h(x, p1), p1).cols):equals(3)
  expect(subs(f(x) + 1, { [f] = function(a) return a^2 end }) == x^2 + 1):is_true()
  expect(subs(diff(f(x^2), x), { [f] = sin }) == cos(x^2)*(2*x)):is_true()
  expect(subs(f(f(x)), { [f] = function(a) return 2*a end }) == 4*x):is_true()
  expect(subs(h(x, p1), { [h] = function(a, b) return { a, b.T*b } end }) == vec{ x, p1.T*p1 }):is_true()
  fails(function() f() end, "'f' needs at least one argument")
  fails(function() evaluate(f(x), { x = 1 }) end, "unspecified function")
  fails(function() subs(f(x), { [f] = 3 }) end, "must be a Lua function")
  fails(function() subs(h(x), { [h] = function(a) return a end }) end, "has 1 entries, but it has 2 outputs")
end)

-- ── substitution, rewriting, text ──

test("subs", function()
  expect(subs(x + y, { [x] = y, [y] = x }) == y + x):is_true()
  expect(subs(x^2, { x = 3 }) == 9):is_true()
  expect(subs(sin(x)*y, { [sin(x)] = z }) == z*y):is_true()
  expect(subs(x.dot + x, { [x] = sin(t) }) == cos(t) + sin(t)):is_true()
  expect(subs(x.ddot, { [x] = t^3 }) == 6*t or simplify(subs(x.ddot, { [x] = t^3 })) == 6*t):is_true()
  expect(subs(x.dot, { [x] = 5 }) == 0):is_true()
  expect(subs(x.dot + x.ddot, { [x] = 5, [x.dot] = t }) == t + 1):is_true()
  expect(subs(p1.dot.T*p1, { [p1] = vec{ t, 0, 0 } }) == t):is_true()
  expect(subs(p1, { q = { 1, 2, 3, 4, 5, 6 } }) == vec{ 1, 2, 3 }):is_true()
  expect(subs(x ~ y, { [x] = 1 }) == (1 ~ y)):is_true()
  fails(function() subs(x, { [x] = 1, x = 2 }) end, "gives 'x' twice")
  fails(function() subs(p1, { [p1] = 1 }) end, "stands for 3 entries, but its value has 1")
  fails(function() subs(x, { 3 }) end, "must be a symbol, an expression, a column or a name")
  fails(function() subs(1/x, { [x] = 0 }) end, "division by zero")
  fails(function() subs(x) end, "bad argument #2 'table'")
end)

test("simplify, expand, latex, code", function()
  expect(simplify(sin(x)^2 + cos(x)^2) == 1):is_true()
  expect(expand((x + 1)^2) == expand(1 + 2*x + x^2)):is_true()
  expect(simplify(vec{ x - x, y*y }) == vec{ 0, y^2 }):is_true()
  expect(latex(x/y)):equals((x/y):latex())
  expect(latex(x ~ y)):equals "x = y"
  for _, e in ipairs{ x^2 + m/3, sin(x.dot)*q[2], ifelse(lt(x, 0), 1, y), sqrt(2)*pi } do
    expect(load("local x, y = vars 'x y'; local q = var('q', 6); local m = param('m', 1); return "
      .. e:code())() == e):is_true()
  end
  expect(load("return " .. A:code())() == A):is_true()
end)

test("columns print by the names of the user's variables", function()
  shows(p2 - p1, "p2 - p1")
  shows((p2 - p1).T*p1.dot, tostring((p2 - p1).T*p1.dot))
  expect(tostring(p1.T*p1)):equals "p1ᵀp1"
end)

test("numbers print with at most 10 digits, long columns in part", function()
  shows(linspace(0, 1, 3), "  0\n0.5\n  1")
  expect(tostring(linspace(0, 1, 1000))):matches "…"
  expect(tostring(linspace(0, 1, 1000))):matches "1000×1 numbers"
end)

-- ── values ──

test("evaluate", function()
  expect(evaluate(x^2 + m, { x = 3 })):equals(10)
  expect(evaluate(x^2 + m, { [x] = 3, m = 2 })):equals(11)
  expect(evaluate(p1, { [p1] = { 1, 0, 0 } })):equals({ 1, 0, 0 })
  expect(evaluate(q, { q = { 1, 2, 3, 4, 5, 6 } })[6]):equals(6)
  expect(evaluate(x + x.dot, { x = 1, ["x'"] = 2 })):equals(3)
  expect(evaluate(x, { x = "1/2", y = 7 })):equals(0.5)
  expect(evaluate(x, { x = sqrt(2) })):near(math.sqrt(2), 0)
  expect(evaluate(t^2, { t = 3 })):equals(9)
  expect(evaluate(A)(2, 2)):equals(4)
  fails(function() evaluate(x*y + k) end, "no value for 'x', 'y', 'k'")
  fails(function() evaluate(x, { w = 1 }) end, "unknown symbol 'w'")
  fails(function() evaluate(x, { [x] = 1, x = 2 }) end, "gives 'x' twice: by the symbol and by its name")
  fails(function() evaluate(log(x), { x = -1 }) end, "'log(x)' has no finite value at x = -1")
  fails(function() evaluate(1 + 1/(x - 1), { x = 1 }) end, "'1/(x - 1)' has no finite value at x = 1")
  fails(function() evaluate(q, { q = { 1, 2 } }) end, "has 2 entries, but 'q' has 6")
  fails(function() evaluate(x, { x = y }) end, "must be a number, but it is the expression y")
  fails(function() evaluate(x, { x = 0/0 }) end, "is nan")
  fails(function() evaluate(x, { [1] = 0 }) end, "it has the key [1]")
  fails(function() evaluate(x, 3) end, "must be a table")
  fails(function() evaluate(x, { [x^2] = 3 }) end, "must be a symbol, not the expression x²")
  fails(function() evaluate(nil) end, "not nil")
end)

test("fn", function()
  local f = fn({ x, y }, x*y)
  expect(f(2, 3)):equals(6)
  expect(f(mat{ { 1, 2 }, { 3, 4 } })):equals({ 2, 12 })
  expect(f(linspace(0, 1, 3), 2)):equals({ 0, 1, 2 })
  local h = fn({ x, p1 }, { x*p1[1], x + p1[3], m })
  expect(h(2, { 1, 2, 3 })):equals({ 2, 5, 1 })
  expect(h({ 1, 2 }, mat{ { 1, 2, 3 }, { 4, 5, 6 } })(2, 2)):equals(8)
  expect(fn(x, x^2)(3)):equals(9)
  expect(fn({ x }, x^2)(linspace(0, 2, 3))):equals({ 0, 1, 4 })
  expect(fn({ p1 }, p1.T*p1)({ 1, 2, 3 })):equals(14)
  expect(fn({ p1 }, p1.T*p1)(eye(3))):equals({ 1, 1, 1 })
  expect(fn({ x }, { { x, 2 }, { 3, x^2 } })(5)(2, 2)):equals(25)
  fails(function() fn({ x }, x*y) end, "no value for 'y'; list it among the arguments")
  fails(function() fn({ x, x }, x) end, "'x' is listed twice")
  fails(function() fn({ x^2 }, x) end, "argument 1 of the function must be a symbol")
  fails(function() f(1) end, "expected 2 arguments (x, y), got 1")
  fails(function() f(1, "a") end, "'a' is not a number")
  fails(function() h(1, { 1, 2 }) end, "argument 'p1' needs 3 numbers per point, not 2")
  fails(function() f({ 1, 2 }, { 1, 2, 3 }) end, "has 3 points, another one 2")
  fails(function() fn({ x }, log(x))(-1) end, "'log(x)' has no finite value at x = -1")
end)

test("the vocabulary can be shadowed", function()
  local t, diff, sum = 3, nil, "mine"
  expect(pendula.diff(x^2, x) == 2*x):is_true()
  expect(pendula.t == pendula.t):is_true()
  expect(t):equals(3)
end)

test("sine and cosine at multiples of π/12", function()
  for k = -24, 24 do
    local angle = k*math.pi/12
    for name, f in pairs { sin = sin, cos = cos } do
      local exact = simplify(f(rational(k, 12)*pi))
      expect(evaluate(exact)):near(math[name](angle), 1e-15)
      expect(tostring(exact):find(name, 1, true)):equals(nil)
      expect(tostring(f(rational(7*k + 1, 7)*pi)):find(name, 1, true) ~= nil):is_true()   -- no root of roots
    end
  end
  expect(tostring(simplify(cos(5*pi/6)))):equals "-√3/2"
end)

test("exact numbers are compared with math.huge, as floats are", function()
  local third, worst = rational "1/3", math.huge
  if third < worst then worst = third end
  expect(worst):equals(third)
  expect(sqrt(2) >= -math.huge):is_true()
  expect(pi < 0/0):is_false()
  expect(function() return var "x" < math.huge end):fails "a condition on symbols is an expression"
end)

test("exact numbers have whole quotients and remainders, and stand in lists that are joined", function()
  expect(1//rational "1/2"):equals(2)
  expect(-7//rational "2/3"):equals(-11)
  expect(-7 % rational "2/3"):equals(rational "1/3")
  expect(sqrt(10)//1):equals(3)
  expect(table.concat({ 1, rational "1/2", sqrt(2) }, ", ")):equals "1, 1/2, √2"
  expect(function() return rational "1/2" // 0 end):fails "division by zero"
  expect(function() return var "x" // 2 end):fails "expressions have no //; write a/b"
  expect(function() return table.concat({ 1, {} }) end):fails "invalid value (table)"
end)
