-- The form in which answers are written: signs, fractions, decimals, one rule for all.
local x, y, z, th = vars "x y z theta"
local a, b, c, d = params "a b c d"

local function prints(e, text) expect((tostring(e):gsub("%s+", " "))):equals(text) end

test("the denominator of a quotient begins with a positive term in textbook order", function()
  for _, f in ipairs { simplify, together, factor } do
    prints(f(1/(b - a)), "-1/(a - b)")
    prints(f((x - y)/(b - a)), "(y - x)/(a - b)")
    prints(f(c/(-a - b)), "-c/(a + b)")
    prints(f(x/(x^2 - a)), "x/(x² - a)")
    prints(f(x/(a - x^2)), "-x/(x² - a)")
    prints(f(1/(y - a)), "1/(y - a)")
    prints(f(1/(c - a - b)), "-1/(a + b - c)")
    prints(f(x.dot/(x.dot - a)), "x′/(x′ - a)")
  end
  prints(together(1/(x^2 - 1) - 1/(1 - x)), "(x + 2)/(x² - 1)")
  prints(factor((d - c)/(b - a)^3), "(c - d)/(a - b)³")
  local names = { "p", "q", "r", "s", "u" }
  for i = 1, 4 do                                             -- whatever the names, 1/(v - u) has one form
    local u, v = param(names[i]), param(names[i + 1])
    expect(tostring(together(1/(v - u)))):equals(tostring(factor(1/(v - u))))
    expect(tostring(simplify(-1/(u - v)))):equals(tostring(factor(1/(v - u))))
  end
end)

test("a sum begins with a positive term if it has one", function()
  local F = input "F"
  prints(-b*x.dot - c*x + F, "F - b x′ - c x")
  prints(a - x.dot^2, "a - x′²")
  prints(-a*x.dot - x + y, "y - a x′ - x")
  prints(-x^2 - x + 1, "-x² - x + 1")                         -- a polynomial keeps its order
  prints(-x.dot - y, "-x′ - y")
end)

test("no parentheses around a sum in a sum", function()
  prints(simplify((x + (a*cos(th) + b)/2)^2/2 - c/2), "(2 x + a cos(θ) + b)²/8 - c/2")
end)

test("squares leave roots of numbers, decimals stay", function()
  prints(sqrt(8), "2 √2")
  prints(sqrt(12)*x, "2 √3 x")
  prints(sqrt(72)*sqrt(2), "12")
  prints(sqrt("3/4"), "√3/2")
  prints(sqrt(1000003), "√1000003")
  prints(sqrt(rational "9.81"), "√9.81")
  expect(evaluate(sqrt(8))):near(math.sqrt(8), 1e-15)
  expect(sqrt(2*10^6)):equals(1000*sqrt(2))
end)

test("half angles, and one notation for coefficients", function()
  prints(simplify((1 - cos(2*x))/2), "sin(x)²")
  prints(simplify(a + a*cos(2*th)), "2 a cos(θ)²")
  prints(simplify((1 - cos(2*x))/(1 + cos(2*x))), "tan(x)²")
  prints(simplify(3 - cos(2*x)), "3 - cos(2 x)")
  local s = param "s"
  prints(apart(s/((s + 1)*(s^2 + 4)), s), "(s + 4)/(5 (s² + 4)) - 1/(5 (s + 1))")
  prints(integral(x*cos(a*x), x, 0, 1), "(a sin(a) + cos(a) - 1)/a²")
  prints(roots(a*x^2 + b*x + c, x), "x = (√(b² - 4 a c) - b)/(2 a) x = -(b + √(b² - 4 a c))/(2 a) "
    .. "where a ≠ 0, b² - 4 a c ≥ 0 (real)")
end)

test("linearisations with decimals are printed in decimals, exact ones exactly", function()
  local decimal = tostring(equilibria(dae { der(x) ~ -0.875*x + 0.25*y, der(y) ~ -0.5*y + 1 }))
  expect(decimal):matches "A = ⎡%-0%.875  0%.25⎤"
  expect(tostring(equilibria(dae { der(x) ~ -x/3 + y, der(y) ~ -y }))):matches "A = ⎡%-1/3   1⎤"
  local box = { within = { x = { -1, 1 } } }
  expect(tostring(equilibria(dae { der(x) ~ sin(x) - x/8 }, box))):matches "A = 0%.875"
  local w = param("omega", { positive = true })
  expect(tostring(equilibria(dae { der(th, 2) ~ -w^2*th }))):matches "θ = 0,  θ′ = 0"
end)

test("courses: partial fractions, transforms, integrals, equations", function()
  local s, w, k = params "s omega k"
  prints(apart((5*x - 4)/(x^2 - x - 2), x), "3/(x + 1) + 2/(x - 2)")
  prints(apart((2*x + 3)/(x - 1)^2, x), "2/(x - 1) + 5/(x - 1)²")
  prints(apart(1/(x^4 - 1), x), "1/(4 (x - 1)) - 1/(4 (x + 1)) - 1/(2 (x² + 1))")
  prints(apart((3*x^2 + 2)/(x*(x^2 + 1)), x), "x/(x² + 1) + 2/x")
  prints(laplace_transform(t^3, t, s), "6/s⁴")
  prints(laplace_transform(1 - cos(w*t), t, s), "ω²/(s (s² + ω²))")
  prints(laplace_transform(sin(t)^2, t, s), "2/(s (s² + 4))")
  prints(inverse_laplace((s + 3)/((s + 1)*(s + 2)), s, t), "2 exp(-t) - exp(-2 t)")
  prints(inverse_laplace(w^2/(s*(s^2 + w^2)), s, t), "1 - cos(ω t)")
  prints(inverse_laplace(1/(s + a)^3, s, t), "t² exp(-a t)/2")
  prints(inverse_laplace(1/(s^2 + w^2)^2, s, t), "(sin(ω t) - ω t cos(ω t))/(2 ω³)")
  prints(integral(x*exp(-x), x, 0, 1), "1 - 2 exp(-1)")
  prints(integral(x^2*sin(x), x, 0, pi), "π² - 4")
  prints(integral(cos(a*x)^2, x, 0, pi/a), "π/(2 a)")
  prints(integral((x - a)*(x - b), x, a, b), "(a - b)³/6")
  prints(integral((1 - x)^3*x^2, x, 0, 1), "1/60")
  prints(solve({ x^2 + y^2 ~ 25, y ~ x + 1 }, { x, y }), "x = -4, y = -3 x = 3, y = 4")
  prints(solve({ x + y + z ~ 6, x - y + z ~ 2, x + 2*y - z ~ 2 }, { x, y, z }), "x = 1, y = 2, z = 3")
  prints(solve({ a*x + b*y ~ 1, b*x + a*y ~ 0 }, { x, y }),
    "x = a/(a² - b²), y = -b/(a² - b²) where (a + b) (a - b) ≠ 0")
  prints(roots(exp(2*x) - 3*exp(x) + 2, x), "x = 0 x = log(2)")
  prints(roots(sqrt(x + 1) - x + 1, x), "x = 3")
  prints(roots(log(x) + log(x - 1) - log(6), x), "x = 3")
  prints(roots(2*sin(x)^2 - 3*sin(x) + 1, x), "x = π/6 + 2 k π x = π/2 + 2 k π x = 5 π/6 + 2 k π")
  prints(factor(6*x^2 + 11*x*y - 10*y^2), "(3 x - 2 y) (2 x + 5 y)")
  prints(simplify((a^3 - b^3)/(a - b)), "a² + a b + b²")
  local al, b1, b2 = params "alpha b1 b2"
  prints(tableau { A = { { 0, 0 }, { al, 0 } }, b = { b1, b2 } }:solve(2),
    "b₁ = 1 - 1/(2 α), b₂ = 1/(2 α), α free where α ≠ 0")
end)
