-- Symbolic work of a course: equations solved in closed form, equilibria, partial fractions, Laplace
-- transforms, integrals. The functions are in stdlib/algebra/*.lua and are read when they are first
-- used.

local module = "algebra"
local title = "Equations, integrals and transforms in closed form"

local read = {}

local function lazy(entry, file)
  entry.module, entry.title = module, title
  entry[1] = function(...)
    read[file] = read[file] or include(file)
    return read[file][entry.name](...)
  end
  doc(entry)
end

lazy({ name = "roots", sig = "roots(e, x) -> list",
  text = [[The solutions of e = 0 (or of an equation) for one symbol, in closed form: polynomials up to
    degree 4 and powers, after factorisation over ℚ (Cardano, cosines where a cubic has three real roots,
    Ferrari), sines, exponentials, logarithms and roots of the unknown. list[i] is a root, .when[i] where
    it is one, .complex the pairs { re =, im = }, .conditions the conditions for all of them. Other
    polynomials with numbers get numbers.]],
  example = 'x = var "x"  return roots(x^3 - x, x)',
  gives = "x = -1\nx = 0\nx = 1" },
  "algebra/solve")

lazy({ name = "solve_equations", sig = "solve_equations({ equations }, { unknowns }) -> list of solutions",
  text = [[All solutions of a system of polynomial or triangular equations in closed form: each factor is
    solved separately, equations that are linear in an unknown are solved for it, resultants eliminate the
    others; a root that needs the formulas of Cardano or Ferrari keeps its name and its equation. A solution
    has its values as s[x] and s.x. solve(equations, unknowns) is the same.]],
  example = 'x, y = vars "x y"  return solve_equations({ x + y ~ 3, x*y ~ 2 }, { x, y })',
  gives = "x = 2,  y = 1\nx = 1,  y = 2" },
  "algebra/solve")

lazy({ name = "equilibria", sig = "equilibria(sys [, { params =, inputs =, within = }]) -> list",
  text = [[The points at which all derivatives are 0. In symbols where no values are given (params =
    true takes those of the model); each with its linearisation A and the characteristic polynomial, for
    mechanisms with constraints in any form det(s E - A) of the free motions, and stability: by the
    eigenvalues where they are numbers, else the conditions of Hurwitz. list[1][x], list[1].A,
    list[1].modes, list[1].stable. Where there is no closed form, within = { T = { 300, 450 }, … } searches a
    box in numbers, by Newton's method from many points of it.]],
  example = 'x = var "x"  r = param "r"  return #equilibria(dae { der(x) ~ r*x - x^3 })',
  gives = "3",
  options = { option("params", "table or boolean", "values of parameters; true: those of the model", "",
      "@parameters"),
    option("inputs", "table", "values of inputs", "", "@inputs"),
    option("within", "table", "{ lower, upper } of each unknown: a search in numbers", "", "@states") },
    options_at = 2 },
  "algebra/equilibria")

lazy({ name = "apart", sig = "apart(e, x) -> expression",
  text = "The partial fractions of a rational function, over the rational numbers.",
  example = 'x = var "x"  return apart(1/(x^2 - 1), x)',
  gives = "1/(2 (x - 1)) - 1/(2 (x + 1))" },
  "algebra/partial_fractions")

lazy({ name = "laplace_transform", sig = "laplace_transform(e, t, s) -> expression",
  text = [[∫₀^∞ e(t) exp(-s t) dt of sums of products of powers of t, exponentials, sines and cosines.
    Derivatives of unknowns: L{x″} = s² X - s x(0) - x′(0), with the symbols X, x0, dx0.]],
  example = 's = param "s"  return laplace_transform(exp(-2*t)*sin(3*t), t, s)',
    gives = "3/(s² + 4 s + 13)" },
  "algebra/laplace")

lazy({ name = "inverse_laplace", sig = "inverse_laplace(F, s, t) -> expression",
  text = [[The function of t ≥ 0 whose transform F(s) is: partial fractions with real or complex pairs of
    poles. A transfer function of tf or ss works too.]],
  example = 's = param "s"  return inverse_laplace(1/(s*(s + 1)), s, t)',
  gives = "1 - exp(-t)" },
  "algebra/laplace")

lazy({ name = "integral", sig = "integral(e, x [, a, b]) -> expression",
  text = [[∫ e dx, or from a to b: polynomials, exponentials, sines and cosines of linear arguments and their
    products; rational functions with factors of degree one and two. Anything else is an error:
    integrate numerically with one more state, der(J) ~ e.]],
  example = 'x = var "x"  return integral(x*sin(x), x, 0, pi)',
  gives = "π" },
  "algebra/integral")

module, title = "method theory", "Methods as an exam asks for them"

lazy({ name = "explain_step", sig = "explain_step(sys, method) -> step",
  text = [[The equations of one step of a Runge-Kutta, BDF or Rosenbrock method for a model: the unknowns and
    their number s (n_x + n_z), r(w, x_k) = 0, the Jacobian M in blocks, the Newton step, the update.
    Fields: r, w, M, size; latex().]],
  example = 'x = var "x"  return explain_step(dae { der(x) ~ -x^2 }, rk.implicit_euler).size',
  gives = "1" }, "explain_step")

lazy({ name = "order_conditions", sig = "order_conditions(p [, tab]) -> conditions",
  text = [[The conditions for order p = 1 … 6 of a Runge-Kutta method, one for each rooted tree, as sums over
    bᵢ, aᵢⱼ, cᵢ; with a tableau also their values for it.]],
  example = "order_conditions(3)",
  gives = "order 1  Σ bᵢ = 1\norder 2  Σ bᵢ cᵢ = 1/2\norder 3  Σ bᵢ aᵢⱼ cⱼ = 1/6\norder 3  Σ bᵢ cᵢ² = 1/3" },
  "tableaus/symbolic")

lazy({ name = "symbolic_tableau", sig = "symbolic_tableau{ A =, b =, c = } -> tableau with symbols",
  text = [[A tableau with symbols among its coefficients; tableau{…} with symbols gives the same. It has
    tab:order_conditions(p), tab:solve(p) for the coefficients of order p, tab:subs{ [a] = 1 },
    which is an ordinary tableau once all symbols have numbers, tab:stability_function(z) and
    tab:latex().]],
  example = 'a = param "a"  return symbolic_tableau { A = { {0, 0}, {a, 0} }, b = { 1 - 1/(2*a), 1/(2*a) } }'
    .. ':stability_function(param "z")',
  gives = "z²/2 + z + 1", options = options_of "tableau", options_at = 1 }, "tableaus/symbolic")
