-- Symbolic work of a course: equations solved in closed form, equilibria, partial fractions, Laplace
-- transforms, integrals. The functions are in stdlib/algebra/*.lua and are read when they are first
-- used.

local module = "algebra"
local title = "Equations, integrals and transforms in closed form"

local read = {}

local function lazy(entry, file)
  entry.module, entry.title = module, title
  entry[1] = function(...)
    read[file] = read[file] or include("algebra/" .. file)
    return read[file][entry.name](...)
  end
  doc(entry)
end

lazy({ name = "roots", sig = "roots(e, x) -> list",
  text = [[The solutions of e = 0 (or of an equation) for one symbol, in closed form: polynomials in factors
    over ℚ of degree one and two or in a power of x, and what one function inverts (sin, exp, …).
    Numbers stand for the roots of other polynomials without parameters. Conditions and complex pairs
    are printed with the list.]],
  example = 'x = var "x"  return roots(x^3 - x, x)',
  gives = "x = 0\nx = 1\nx = -1" }, "solve")

lazy({ name = "solve_equations", sig = "solve_equations({ equations }, { unknowns }) -> list of solutions",
  text = [[All solutions of a system of polynomial or triangular equations in closed form: factors are taken
    apart, equations that are linear in an unknown are solved for it, resultants eliminate what is
    left. A solution answers s[x] and s.x. solve(equations, unknowns) is the same.]],
  example = 'x, y = vars "x y"  return solve_equations({ x + y ~ 3, x*y ~ 2 }, { x, y })',
  gives = "x = 2,  y = 1\nx = 1,  y = 2" }, "solve")

lazy({ name = "equilibria", sig = "equilibria(sys [, { params =, inputs =, unknowns = }]) -> list",
  text = [[The points where nothing moves: all derivatives 0. In symbols where no values are given (params =
    true takes those of the model); each with its linearisation A, the characteristic polynomial, and
    stability: by the eigenvalues where they are numbers, else the conditions of Hurwitz. list[1][x],
    list[1].A, list[1].stable.]],
  example = 'x = var "x"  r = param "r"  return #equilibria(dae { der(x) ~ r*x - x^3 })',
  gives = "3" },
    "equilibria")

lazy({ name = "apart", sig = "apart(e, x) -> expression",
  text = "The partial fractions of a rational function, over the rational numbers.",
  example = 'x = var "x"  return apart(1/(x^2 - 1), x)',
  gives = "1/(2 (x - 1)) - 1/(2 (x + 1))" },
    "partial_fractions")

lazy({ name = "laplace_transform", sig = "laplace_transform(e, t, s) -> expression",
  text = [[∫₀^∞ e(t) exp(-s t) dt of sums of products of powers of t, exponentials, sines and cosines.
    Derivatives of unknowns: L{x′} = s X - x(0), with the symbols X and x0.]],
  example = 's = param "s"  return laplace_transform(exp(-2*t)*sin(3*t), t, s)',
    gives = "3/(s² + 4 s + 13)" },
  "laplace")

lazy({ name = "inverse_laplace", sig = "inverse_laplace(F, s, t) -> expression",
  text = [[The function of t ≥ 0 whose transform F(s) is: partial fractions with real or complex pairs of
    poles. A transfer function of tf or ss works too.]],
  example = 's = param "s"  return inverse_laplace(1/(s*(s + 1)), s, t)',
  gives = "1 - exp(-t)" }, "laplace")

lazy({ name = "integral", sig = "integral(e, x [, a, b]) -> expression",
  text = [[∫ e dx, or from a to b: polynomials, exponentials, sines and cosines of linear arguments and their
    products; rational functions with factors of degree one and two. Anything else is an error:
    integrate numerically with one more state, der(J) ~ e.]],
  example = 'x = var "x"  return integral(x*sin(x), x, 0, pi)',
  gives = "π" }, "integral")
