-- The verdict on the system Jacobian, what the index depends on, and how the parts that cannot be solved are
-- named. Every answer is derived by hand beside the model.

local function has(value, words) expect(tostring(value):find(words, 1, true) ~= nil):equals(true) end

local function answers(sys, index, dof)
  expect(sys:index()):equals(index)
  expect(sys:dof()):equals(dof)
  local s = sys:structure()
  expect(s.index):equals(index)
  expect(s.dof):equals(dof)
  return s
end

-- ── parameters ─────────────────────────────────────────────────────────────────────────────────────────────

test("0 = x + a z: index 1 for a ≠ 0; for a = 0 the equation is 0 = x, index 2, nothing free", function()
  local x, z = vars "x z"
  local a = params "a"
  local s = answers(dae { der(x) ~ z, 0 ~ x + a*z }, 1, 1)
  expect(s.verdict):equals("valid")
  has(s, "the structural answer holds where a ≠ 0")
  has(s, "for a = 0: index 2, 0 free initial values")
  s = answers(dae { der(x) ~ z, 0 ~ x + a*z }:with { a = 0 }, 2, 0)
  expect(s.verdict):equals("identically singular")
  expect(s.valid):equals(false)
  expect(s.structural_index):equals(1)
  has(s, "identically singular for a = 0 (full rank 2 for almost all other values)")
  has(s, "for a ≠ 0: index 1, 1 free initial value")
  answers(dae { der(x) ~ z, 0 ~ x + a*z }:with { a = 2 }, 1, 1)
end)

test("the same nonlinear: 0 = sin x + a z", function()
  local x, z = vars "x z"
  local a = params "a=0"
  local sys = dae { der(x) ~ z + z^3, 0 ~ sin(x) + a*z }
  local s = answers(sys, 2, 0)
  expect(s.valid):equals(false)
  has(s, "for a ≠ 0: index 1, 1 free initial value")
  answers(sys:with { a = 1 }, 1, 1)
end)

test("a x′ = -x + sin t with a = 0 is no differential equation", function()
  local x, a = var "x", param("a", 0)
  has(answers(dae { a*der(x) ~ -x + sin(t) }, 1, 0), "for a ≠ 0: index 0, 1 free initial value")
end)

test("exceptional values other than zero: (a - 2) z", function()
  local x, z, a = var "x", var "z", param "a"
  has(dae { der(x) ~ z, 0 ~ x + (a - 2)*z }:structure(), "for a = 2: index 2, 0 free initial values")
end)

test("reduce and init know that the structure is wrong for a = 0", function()
  local x, z, a = var "x", var "z", param("a", 0)
  local sys = dae { der(x) ~ z, 0 ~ x - sin(t) + a*z }
  local at = sys:init { from = 1 }       -- x = sin t, z = cos t
  expect(at(x)):near(math.sin(1), 1e-10)
  expect(at(z)):near(math.cos(1), 1e-10)
end)

-- ── singular points and branches ───────────────────────────────────────────────────────────────────────────

test("y = z³: index 1 where z ≠ 0; there are consistent points with z = 0", function()
  local y, z = vars "y z"
  local sys = dae { der(y) ~ z, 0 ~ y - z^3 }
  local s = answers(sys, 1, 1)
  expect(s.nonzero):equals { z }
  has(s, "holds where z ≠ 0")
  has(s, "singular points: there are consistent points with z = 0; the index changes there")
  s = sys:structure { at = sys:init { fix = { y = 8 }, guess = { z = 1 } } }     -- J = [1 0; 1 -12]
  expect(s.verdict):equals("valid")
  has(s, "at the given point σ_min/σ_max = ")
end)

test("x x′ = 1: the Jacobian x is not zero where the equation holds", function()
  local x = var "x"
  local s = answers(dae { x*der(x) ~ 1 }, 0, 1)
  has(s, "holds where x ≠ 0; no consistent point where that fails was found")
end)

test("t x′ = x: the index changes at t = 0", function()
  local x = var "x"
  has(answers(dae { t*der(x) ~ x }, 0, 1), "holds where t ≠ 0")
end)

test("0 = z³ has no index by ranks: the gradient vanishes wherever the equation holds", function()
  local y, z = vars "y z"
  local sys = dae { der(y) ~ z, 0 ~ z^3 }
  local s = sys:structure()
  expect(s.verdict):equals("identically singular")
  expect(s.index):equals(nil)
  has(s, "identically singular where the equations hold (full rank 2 in general")
  expect(function() sys:index() end):fails "write C = 0"
  expect(function() sys:dof() end):fails "no index can be given"
end)

test("a squared constraint is refused, not integrated", function()
  local q = var("q", 2)
  local sys = lagrange { q = q, T = q.dot.T*q.dot/2, V = 9.81*q[2], C = { (q.T*q - 1)^2 } }
  expect(sys:structure().verdict):equals("identically singular")
  expect(function() sys:init { fix = { q = { 0.6, -0.8 } } } end):fails "singular where the equations hold"
  expect(function() sys:reduce("acc") end):fails "write C = 0"
end)

test("a cubed constraint is refused whatever was made before it in the session", function()
  local x, y, l, z, w, m = vars "x y l z w m"
  local function refused()
    local cubed = dae { der(x, 2) ~ -l*x, der(y, 2) ~ -l*y - 9.81, 0 ~ (x^2 + y^2 - 1)^3 }
    expect(function() cubed:index() end):fails "write C = 0"
  end
  refused()
  expect(dae { der(x, 2) ~ -2*l*x, der(y, 2) ~ -2*l*y - 9.81, 0 ~ x^2 + y^2 - 1 }:index()):equals(3)
  refused()
  expect(dae { der(x, 2) ~ 2*m*(z - x) - 2*l*x, der(y, 2) ~ 2*m*(w - y) - 2*l*y, der(z, 2) ~ -2*m*(z - x),
    der(w, 2) ~ -2*m*(w - y), 0 ~ x^2 + y^2 - 1, 0 ~ (z - x)^2 + (w - y)^2 - 1 }:index()):equals(3)
  refused()
end)

test("0 = x e^{xy}: J = x² e^{xy} vanishes with the equation; the truth is 0 = x, index 2", function()
  local x, y = vars "x y"
  local s = answers(dae { der(x) ~ y, 0 ~ x*exp(x*y) }, 2, 0)
  expect(s.verdict):equals("identically singular")
  expect(s.structural_index):equals(1)
end)

test("0 = x + z x² has the branches z = -1/x (index 1) and x = 0 (index 2): both are told", function()
  local x, z = vars "x z"
  local s = answers(dae { der(x) ~ z + cos(t), 0 ~ x + z*x^2 }, 1, 1)
  has(s, "there are consistent points with x = 0")
  has(s, "on another branch of the solutions, where the system Jacobian is singular: index 2, 0 degrees of freedom")
end)

test("verdict at a point: the planar pendulum in y near the horizontal, x x′ + y y′ = 0 solved for y′",
  function()
  -- 0 = x - cos(φ), 0 = y - sin(φ) with y(t) prescribed: J contains cos φ, which is 0 at φ = π/2
  local x, phi = vars "x phi"
  local sys = dae { 0 ~ x - cos(phi), 0 ~ sin(t) - sin(phi) }
  local at = sys:init { from = math.pi/2, guess = { phi = 1.5, x = 0 } }
  local s = sys:structure { at = at }
  expect(s.structural_index):equals(1)
  has(s, "cos(φ) ≠ 0")
end)

-- ── parts that cannot be solved ────────────────────────────────────────────────────────────────────────────

test("too many and too few equations are named by number and name, with what can be done", function()
  local x, y, w, z = vars "x y w z"
  local u = input "u"
  local over = dae { der(x) ~ 1, 0 ~ x - t }
  expect(function() over:index() end):fails "the model has 2 equations for 1 unknown"
  expect(function() over:index() end):fails "over-determined: 2 equations (1), (2) for 1 unknown x"
  expect(function() over:dof() end):fails "Remove one of the equations that are too many"
  local under = dae { der(x) ~ y + u, 0 ~ w - u }
  expect(function() under:index() end):fails "under-determined: 1 equation (1) for 2 unknowns x, y"
  expect(function() under:integrate{ start = { x = 1 }, to = 1 } end):fails "let one of the unknowns be given"
  expect(function() under:init {} end):fails "let one of the unknowns be given: y = input \"y\""
  local s = under:structure()
  expect(s.under.equations):equals { "(1)" }
  expect(s.under.unknowns):equals { x, y }
  expect(s.over.equations):equals {}
  expect(s.J):equals(nil)
  local both = dae { der(x) ~ y, 0 ~ x - 1, 0 ~ x - sin(t), der(z) ~ y + w }   -- (1) gives y
  expect(function() both:index() end):fails "the model is structurally singular"
  expect(function() both:index() end):fails "over-determined: 2 equations (2), (3) for 1 unknown x"
  expect(function() both:index() end):fails "under-determined: 1 equation (4) for 2 unknowns w, z"
end)

test("rows 0 = 0 are allowed in E x′ = A x and named; elsewhere they are refused", function()
  local sys = dae.linear { E = { {1,0}, {0,0} }, A = { {0,1}, {0,0} } }
  expect(sys:structure().verdict):equals("structurally singular")
  has(sys:structure(), "without unknown: equation (1b) reads 0 = 0")
  expect(function() sys:index() end):fails "equation (1b) reads 0 = 0"
  local x, a = var "x", param "a"
  has(dae { der(x) ~ x, 0 ~ a - t }:structure(), "without unknown: equation (2) reads 0 = t - a")
  has(dae { der(x) ~ -x, der(param "k") ~ -param "k" }:structure(),
    "equation (2) reads 0 = k; k is a parameter, an unknown is declared by k = var \"k\"")
end)

test("equations that depend on each other or contradict each other", function()
  local x, y, z = vars "x y z"
  expect(function() dae { der(x) ~ y,
    2*der(x) ~ 2*y }:index() end):fails "the equations depend on each other: one more is needed"
  expect(function() dae { der(x) ~ y,
    der(x) ~ y + 1 }:index() end):fails "the equations contradict each other"
  expect(function() dae { 0 ~ x*y - 1, 0 ~ x^2*y^2 - 1, der(z) ~ x }:index() end):fails "dependent equations"
end)

test("Kunkel & Mehrmann 2006, Ex. 3.1 and 3.2: the pencil says nothing about systems that depend on t",
  function()
  local x1, x2 = vars "x1 x2"
  -- E = [-t t²; -1 t], A = -I: regular pencils for all t, and yet x = c(t) (t, 1) solves it for every c
  local free = dae { -t*der(x1) + t^2*der(x2) ~ -x1, -der(x1) + t*der(x2) ~ -x2 }
  expect(function() free:index() end):fails "the equations depend on each other"
  expect(free:structure().valid):equals(false)
  -- E = [0 0; 1 -t], A = [-1 t; 0 0]: singular pencils for all t, and yet x2 = f2 - f1′, x1 = t x2 + f1
  answers(dae { 0 ~ -x1 + t*x2 + sin(t), der(x1) - t*der(x2) ~ cos(t) }, 2, 0)
end)

-- ── fields ─────────────────────────────────────────────────────────────────────────────────────────────────

test("J, blocks, gap", function()
  local x, y, z = vars "x y lambda"
  local sys = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local s = sys:structure { at = sys:init { fix = { x = 0.6, [x.dot] = 0.8 }, guess = { y = -0.8 } } }
  expect(evaluate(s.J, { x = 2, y = 3 })):near({ {1, 0, 2}, {0, 1, 3}, {-4, -6, 0} }, 0)
  expect(#s.blocks):equals(1)
  expect(s.blocks[1].equations):equals { "(1)", "(2)", "(3)" }
  expect(s.gap > 0.1 and s.gap <= 1):equals(true)
  expect(s.nonzero[1]):equals(x^2 + y^2)
end)

-- ── what hides from structure ──────────────────────────────────────────────────────────────────────────────

test("x z = 0: z = 0 with x free (index 1), or x = 0 (index 2)", function()
  local x, z = vars "x z"
  local s = answers(dae { der(x) ~ z - 1, 0 ~ x*z }, 1, 1)
  has(s, "on another branch of the solutions, where the system Jacobian is singular: index 2, 0 degrees of freedom")
end)

test("parameter values that make an entry vanish: a - b, and cos(a) at π/2", function()
  local x, z = vars "x z"
  local a, b = params "a=1 b=1"
  answers(dae { der(x) ~ z, 0 ~ x - sin(t) + (a - b)*z }, 2, 0)
  local c = param("c", math.pi/2)
  local s = answers(dae { der(x) ~ z, 0 ~ x - sin(t) + cos(c)*z }, 2, 0)
  expect(s.verdict):equals("identically singular")
end)

test("identities of sine, tangent and exponential do not hide a dependence", function()
  local x, y, z = vars "x y z"
  for _, pair in ipairs { { sin(2*x), 2*sin(x)*cos(x) }, { tan(x)*cos(x), sin(x) },
    { exp(x + z), exp(x)*exp(z) } } do
    local sys = dae { 0 ~ pair[1] - y, 0 ~ pair[2] - y, der(z) ~ x }
    expect(sys:structure().valid):equals(false)
    expect(function() sys:index() end):fails "the equations depend on each other"
  end
end)

test("the index of a piecewise model is told for every region", function()
  local x, z = vars "x z"
  local s = dae { der(x) ~ z, 0 ~ ifelse(lt(t, 1), z - 1, x - sin(t)) }:structure()
  has(s, "the model is piecewise: index 1, 1 free initial value where t < 1; index 2, 0 free initial values where t ≥ 1")
  answers(dae { der(x) ~ -z, 0 ~ z + abs(z)/2 - x }, 1, 1)
  expect(tostring(dae { der(x) ~ -z, 0 ~ z + abs(z)/2 - x }:structure()):find("piecewise")):equals(nil)
end)

test("ring modulator without Cs (Horneber): (4) + (6) - (3) - (5) is 0 = y10 + y11 + y12 + y13, index 2, ten free values", function()
  local y = var("y", 15)
  local function q(U) return 40.67286402e-9*(exp(17.7493332*U) - 1) end
  local U1, U2 = 0.5*sin(2000*pi*t), 2*sin(20000*pi*t)
  local q1, q2 = q(y[3] - y[5] - y[7] - U2), q(-y[4] + y[6] - y[7] - U2)
  local q3, q4 = q(y[4] + y[5] + y[7] + U2), q(-y[3] - y[6] + y[7] + U2)
  local sys = dae {
    1.6e-8*der(y[1]) ~ y[8] - y[10]/2 + y[11]/2 + y[14] - y[1]/25000,
    1.6e-8*der(y[2]) ~ y[9] - y[12]/2 + y[13]/2 + y[15] - y[2]/25000,
    0 ~ y[10] - q1 + q4, 0 ~ -y[11] + q2 - q3, 0 ~ y[12] + q1 - q3, 0 ~ -y[13] - q2 + q4,
    1e-8*der(y[7]) ~ -y[7]/50 + q1 + q2 - q3 - q4, 4.45*der(y[8]) ~ -y[1], 4.45*der(y[9]) ~ -y[2],
    2e-3*der(y[10]) ~ y[1]/2 - y[3] - 17.3*y[10], 5e-4*der(y[11]) ~ -y[1]/2 + y[4] - 17.3*y[11],
    2e-3*der(y[12]) ~ y[2]/2 - y[5] - 17.3*y[12], 5e-4*der(y[13]) ~ -y[2]/2 + y[6] - 17.3*y[13],
    5e-4*der(y[14]) ~ -y[1] + U1 - 86.3*y[14], 5e-4*der(y[15]) ~ -y[2] - 636.3*y[15] }
  answers(sys, 2, 10)          -- eleven states and one condition on them
  has(sys:constraints(), "0 = y₁₀ + y₁₁ + y₁₂ + y₁₃")
end)

-- ── literature ─────────────────────────────────────────────────────────────────────────────────────────────

test("Campbell & Griepentrog 1995: two-link flexible arm on a prescribed path, true index 5, structure 3",
  function()
  local x1, x2, x3, x4, x5, x6, u1, u2 = vars "x1 x2 x3 x4 x5 x6 u1 u2"
  local d = 2 - cos(x3)^2
  local a, b, c, e = 2/d, cos(x3)/d, sin(x3)/d, sin(x3)*cos(x3)/d
  local sys = dae { der(x1) ~ x4, der(x2) ~ x5, der(x3) ~ x6,
    der(x4) ~ 2*c*(x4 + x6)^2 + x4^2*e + (2*x3 - x2)*(a + 2*b) + a*(u1 - u2),
    der(x5) ~ -2*c*(x4 + x6)^2 - x4^2*e + (2*x3 - x2)*(1 - 3*a - 2*b) - a*u1 + (a + 1)*u2,
    der(x6) ~ -2*c*(x4 + x6)^2 - x4^2*e + (x2 - 2*x3)*(a - 9*b) - 2*x4^2*c - (x4 + x6)^2*e
      - (a + b)*(u1 - u2),
    0 ~ cos(x1) + cos(x1 + x3) - cos(exp(t) - 1) - cos(t - 1),
    0 ~ sin(x1) + sin(x1 + x3) - sin(1 - exp(t)) - sin(1 - t) }
  local s = answers(sys, 5, 0)
  expect(s.structural_index):equals(3)
  expect(s.verdict):equals("identically singular")
end)

test("Hessenberg forms of size 1 to 4; car axis; two pendula (index 5)", function()
  local x, y, w, z = vars "x y w z"
  answers(dae { der(x) ~ -x*z, 0 ~ z + z^3 - x }, 1, 1)
  answers(dae { der(x) ~ x*y*z, der(y) ~ x^2*y^2 - 3*y^2*z, 0 ~ x^2*y - 1 }, 2, 1)        -- Jay 1995
  answers(dae { der(x) ~ x*y, der(y) ~ x^2*z + sin(y), 0 ~ x^2 - 1 - t^2 }, 3, 0)
  answers(dae { der(x) ~ y + x^3, der(y) ~ w*x, der(w) ~ z*exp(y), 0 ~ x - 1 - t^2 }, 4, 0)
  local u, v, k, l = vars "u v kappa lambda"
  answers(dae { der(x, 2) ~ -x*l, der(y, 2) ~ -y*l - 9.81, 0 ~ x^2 + y^2 - 1,
                der(u, 2) ~ -u*k, der(v, 2) ~ -v*k - 9.81, 0 ~ u^2 + v^2 - (1 + 0.1*l)^2 }, 5, 4)
end)

test("circuits: C-V loop 2, L-I cutset 2, capacitors that form no tree 1", function()
  local v, i, e1, e2 = vars "v i e1 e2"
  answers(dae { der(v) ~ i, 0 ~ v - sin(t) }, 2, 0)
  answers(dae { der(i) ~ v, 0 ~ i - cos(t) }, 2, 0)
  answers(dae { der(e1) - der(e2) ~ -e1, -der(e1) + der(e2) ~ 1 - e2^3 }, 1, 1)
end)

test("x y = 1, x′ + y′ = u1 (Pantelides' kind): structural 2, true 1", function()
  local x, y, u1, u2 = vars "x y u1 u2"
  local s = answers(dae { der(x) + der(y) ~ u1, 0 ~ x*y - 1, 0 ~ u1 + u2 - t, 0 ~ u1 - u2 }, 1, 1)
  expect(s.structural_index):equals(2)
end)

-- ── constraints ────────────────────────────────────────────────────────────────────────────────────────────

local function conditions(sys, n, ...)
  local list = sys:constraints()
  expect(#list):equals(n)
  for _, words in ipairs { ... } do has(list, words) end
end

test("conditions on the states are complete where coefficients depend on t", function()
  local x1, x2 = vars "x1 x2"
  conditions(dae { x1 - t/4*x2 ~ exp(-t), der(x1) - t/4*der(x2) + 3/4*x2 ~ 0 }, 2,
             "0 = x₁ - t x₂/4 - exp(-t)", "0 = x₂ - exp(-t)", "(1)′ with (2)")
  conditions(dae { 0 ~ -x1 + t*x2 + cos(t), der(x1) - t*der(x2) ~ 0 }, 2, "0 = x₁ - t x₂ - cos(t)",
    "0 = x₂ - sin(t)")
end)

test("they do not contain what is no state: algebraic variables and highest derivatives are eliminated",
  function()
  local x1, x2, x, y, u, v, k, l = vars "x1 x2 x y u v kappa lambda"
  local h1, h2 = input "h1", input "h2"
  conditions(dae { 0 ~ x1 + exp(-der(x1) - x2*der(x2, 2)) + h1, 0 ~ x1 + x2*der(x2) + x2^2 + h2 }, 2,
             "0 = exp(x₂′² + 2 x₂ x₂′ + h₂′) + x₁ + h₁")
  local L, g, c = params "L=1 g=9.81 c=0.1"
  local two = dae { der(x, 2) ~ -x*l, der(y, 2) ~ -y*l - g, 0 ~ x^2 + y^2 - L^2,
                    der(u, 2) ~ -u*k, der(v, 2) ~ -v*k - g, 0 ~ u^2 + v^2 - (L + c*l)^2 }
  conditions(two, 4, "(6) with (3)″, (1), (2):")          -- λ = (x′² + y′² - g y)/(x² + y²)
  local C, T, R, Tc = vars "C T R Tc"
  local K1, K4, K5, C0 = params "K1=1 K4=1 K5=1 C0=1"
  local in_ = input "u"
  conditions(dae { der(C) ~ K1*(C0 - C) - R, der(T) ~ K1*(1 - T) + R - (T - Tc), 0 ~ R - K4*exp(-K5/T)*C,
    0 ~ C - in_ }, 2,
             "0 = C - u", "exp(-K₅/T)")
end)

test("where elimination does not reach a condition, the list says that it is incomplete", function()
  local x, y = vars "x y"
  local sys = dae { (der(x) + der(y))^2 ~ 1 + x, sin(der(x) + der(y)) ~ y }       -- y = sin √(1 + x)
  expect(sys:dof()):equals(1)
  has(sys:constraints(), "incomplete")
end)

-- ── classification ─────────────────────────────────────────────────────────────────────────────────────────

test("exam 3(f): g(x) cannot give z, so the index is at least 2", function()
  local x, z, u = var "x", var "z", input "u"
  local f, g = func "f", func "g"
  local sys = dae { der(x) ~ f(x, z, u), 0 ~ g(x) }
  expect(sys:index()):equals(2)
  has(sys, "(2) does not contain the algebraic variables: ∂g/∂z is rank deficient, so the index is at least 2")
  has(sys, "index 2 where ∂g/∂x ≠ 0, ∂f/∂z ≠ 0; where one of them vanishes identically, the index is at least 3")
  has(dae { der(x) ~ f(x, z, u), 0 ~ g(x, z, u) },
    "index 1 where ∂g/∂z ≠ 0; where it vanishes identically, the index is at least 2")
end)

test("exam 3(e): x′ = A x + b z, 0 = g(x): index 2 iff ∂g/∂x b ≠ 0, g(x(0)) = 0", function()
  local x, z = var("x", 2), var "z"
  local b1, b2 = params "b1 b2"
  local g = func "g"
  local A = mat { { param "a11", param "a12" }, { param "a21", param "a22" } }
  local sys = dae { der(x) ~ A*x + vec { b1, b2 }*z, 0 ~ g(x[1], x[2]) }
  has(sys, "index 2 where b₁ ∂g/∂x₁ + b₂ ∂g/∂x₂ ≠ 0; where it vanishes identically, the index is at least 3")
  has(sys, "consistency")
  has(sys:structure(), "index 2 where b₁ ∂g/∂x₁ + b₂ ∂g/∂x₂ ≠ 0")
  has(sys:reduce("acc"):trace(), "The original model has index 2 where b₁ ∂g/∂x₁ + b₂ ∂g/∂x₂ ≠ 0")
  local wrong = func("g", 2)        -- m = 1: as many rows as z
  expect(function() dae { der(x) ~ A*x + vec { b1, b2 }*z,
    0 ~ wrong(x[1], x[2]) }:index() end):fails "over-determined: 4 equations"
end)

test("exam 3(a)-(c): counts with their reason", function()
  local x, z, u = var("x", 2), var("z", 1), input "u"
  local semi = dae.semi_explicit { x = x, z = z, u = u, f = vec { x[2], z - u }, g = vec { x[1] + z^3 } }
  has(semi:implicit():trace(),
    "n = n_x = 2, n_z = 1, n_u = 1: x′ has as many entries as x, and F has m = 3 = n_x + n_z rows")
  local full = dae.implicit { x = x, z = z, u = u,
    F = vec { der(x[1]) - x[2], der(x[2])^3 + z - u, x[1] + z^3 } }
  has(full:semi_explicit():trace(), "g has 3 rows, as many as there are algebraic variables")
end)

test("exam 3(d)1: E is singular, so it is a DAE; with regular E an implicit ODE", function()
  has(dae.linear { E = { {1,1,0}, {0,0,1}, {1,1,1} }, A = eye(3) },
      "singular (rank 2 of 3; (1c) depends on the others): a DAE, though every unknown is differentiated")
  has(dae.linear { E = { {1,1}, {0,1} }, A = eye(2) }, "nonsingular (rank 2): an implicit ODE")
end)

-- ── size ───────────────────────────────────────────────────────────────────────────────────────────────────

test("large sparse models: the ladder is regular at every point, printing is bounded", function()
  local N = 300
  local w, v = var("w", N), var("v", N)
  local e = {}
  for k = 1, N do
    e[#e+1] = 0 ~ ((k > 1 and v[k-1] or sin(t)) - w[k]) + (v[k] - w[k]) - (exp(w[k]) - 1)
    e[#e+1] = der(v[k]) ~ (w[k] - v[k]) + (k < N and (w[k+1] - v[k]) or 0)
  end
  local sys = dae(e)
  local s = sys:structure()
  expect(s.index):equals(1)
  expect(s.dof):equals(N)
  has(s, "system Jacobian regular at every point")
  has(sys, "540 more (sys.equations has all 600)")
  expect(function() return s.J end):fails "the system Jacobian has 600 rows; it is written out up to 300"
end)

test("a form is called what it was asked for: fully implicit, implicit ODE, semi-explicit", function()
  local x, z = var("x", 2), var "z"
  local semi = dae { der(x) ~ vec{ z, x[1] }, 0 ~ z - x[2]^2 }
  expect(semi.kind):equals "semi-explicit"
  expect(semi:implicit().kind):equals "fully implicit"
  expect(semi:implicit():index()):equals(1)
  expect(semi:implicit():semi_explicit().kind):equals "semi-explicit"
  local F = dae.implicit { x = x, z = z, F = { x[1].dot + z, x[2].dot - x[1], z - x[2]^2 } }
  expect(F.kind):equals "fully implicit"
  has(F:semi_explicit(), "(1a)  x₁′ = -z\n  (1b)  x₂′ = x₁\n  (2)   0 = ")
  expect(#F:semi_explicit().algebraic):equals(1)     -- no δ: every derivative has a row of its own
  expect(dae.implicit { x = x, F = { x[1].dot + x[2], x[2].dot - x[1] } }.kind):equals "implicit ODE"
end)

test("torques that act as their difference: a new unknown repairs the structure of the robot arm", function()
  local sys = problems.robot_arm()
  expect(sys:index()):equals(5)
  has(sys:reduce "acc":trace(), "new unknown:  w₁ = u₁ - u₂   valid everywhere")
end)

test("a nonlinear pair of shared unknowns", function()
  -- x₁ and x₂ contain a, b as a + 2 b only: (1) and (2) determine y and a + 2 b, (3) then a; by hand: index
  -- 3, y and y′ fixed
  local x1, x2, y, a, b = vars "x1 x2 y a b"
  local sys = dae { der(x1) ~ sin(a + 2*b) + y, der(x2) ~ 3*(a + 2*b) - y, der(y) ~ a - b, x1 ~ sin(t),
    x2 ~ cos(t) }
  expect(sys:structure().verdict):equals "identically singular"
  expect(sys:index()):equals(3)
  expect(sys:dof()):equals(0)
  expect(#sys:constraints()):equals(3)
end)

test("an equation without a solution gives no index, and is named", function()
  local x, y, z, w = vars "x y z w"
  local function none(sys, words)
    for _, call in ipairs { sys.index, sys.dof } do
      expect(function() call(sys) end):fails(words)
    end
    has(sys:structure(), words)
  end
  none(dae { 0 ~ exp(y/3), 0 ~ y + 2*z - sin(y), der(z) ~ z + w + exp(y/3), der(w) ~ sin(x) },
    "equation (1)  0 = exp(y/3) has no solution")
  none(dae { der(x) ~ y, 0 ~ exp(x) + 1 }, "equation (2)  0 = exp(x) + 1 has no solution")
  none(dae { der(x) ~ y, 0 ~ 1e12*x^2 + 1e-6 }, "has no solution")
  none(dae { der(x) ~ y, der(w) ~ z, 0 ~ x^2 + y^2 - 1, 0 ~ w^2 + exp(x) - exp(-y) + 5 },
    "the equations (3), (4) have no solution in common")
  expect(dae { der(x) ~ y, 0 ~ exp(x) - 1 }:index()):equals(2)
end)
