-- The verdict on the system Jacobian, what the index depends on, and how the parts that cannot be solved are named.
-- Every answer is derived by hand beside the model.

local function has(value, words) expect(tostring(value):find(words, 1, true) ~= nil):equals(true) end

local function answers(sys, index, dof)
  expect(sys:index()):equals(index)
  expect(sys:dof()):equals(dof)
  local s = sys:structure()
  expect(s.index):equals(index)
  expect(s.dof):equals(dof)
  return s
end

-- ── parameters ──────────────────────────────────────────────────────────────────────────────────────────────────────

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

-- ── singular points and branches ────────────────────────────────────────────────────────────────────────────────────

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
  expect(function() sys:index() end):fails "Write C = 0"
  expect(function() sys:dof() end):fails "no index can be given"
end)

test("a squared constraint is refused, not integrated", function()
  local q = var("q", 2)
  local sys = lagrange { q = q, T = q.dot.T*q.dot/2, V = 9.81*q[2], C = { (q.T*q - 1)^2 } }
  expect(sys:structure().verdict):equals("identically singular")
  expect(function() sys:init { fix = { q = { 0.6, -0.8 } } } end):fails "singular where the equations hold"
  expect(function() sys:reduce("acc") end):fails "Write C = 0"
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

test("verdict at a point: the planar pendulum in y near the horizontal, x x′ + y y′ = 0 solved for y′", function()
  -- 0 = x - cos(φ), 0 = y - sin(φ) with y(t) prescribed: J contains cos φ, which is 0 at φ = π/2
  local x, phi = vars "x phi"
  local sys = dae { 0 ~ x - cos(phi), 0 ~ sin(t) - sin(phi) }
  local at = sys:init { from = math.pi/2, guess = { phi = 1.5, x = 0 } }
  local s = sys:structure { at = at }
  expect(s.structural_index):equals(1)
  has(s, "cos(φ) ≠ 0")
end)

-- ── parts that cannot be solved ─────────────────────────────────────────────────────────────────────────────────────

test("too many and too few equations are named by number and name, with what can be done", function()
  local x, y, w, z = vars "x y w z"
  local u = input "u"
  local over = dae { der(x) ~ 1, 0 ~ x - t }
  expect(function() over:index() end):fails "the model has 2 equations for 1 unknown"
  expect(function() over:index() end):fails "over-determined: 2 equations (1), (2) for 1 unknown x"
  expect(function() over:dof() end):fails "Remove one of the equations that are too many"
  local under = dae { der(x) ~ y + u, 0 ~ w - u }
  expect(function() under:index() end):fails "under-determined: 1 equation (1) for 2 unknowns x, y"
  expect(function() under:init {} end):fails "let one of the unknowns be given: y = input \"y\""
  local s = under:structure()
  expect(s.under.equations):equals { "(1)" }
  expect(s.under.unknowns):equals { x, y }
  expect(s.over.equations):equals {}
  expect(s.J):equals(nil)
  local both = dae { der(x) ~ y, 0 ~ x - 1, 0 ~ x - sin(t), der(z) ~ y + w }   -- (1) gives y
  expect(function() both:index() end):fails "the model is structurally singular"
  expect(function() both:index() end):fails "over-determined: 2 equations (2), (3) for 1 unknown x"
  expect(function() both:index() end):fails "under-determined: 1 equation (4) for 2 unknowns z, w"
end)

test("rows 0 = 0 are allowed in E x′ = A x and named; elsewhere they are refused", function()
  local sys = dae.linear { E = { {1,0}, {0,0} }, A = { {0,1}, {0,0} } }
  expect(sys:structure().verdict):equals("structurally singular")
  has(sys:structure(), "without unknown: equation (1b) reads 0 = 0")
  expect(function() sys:index() end):fails "equation (1b) reads 0 = 0"
  local x, a = var "x", param "a"
  has(dae { der(x) ~ x, 0 ~ a - t }:structure(), "without unknown: equation (2) reads 0 = t - a")
end)

test("equations that depend on each other or contradict each other", function()
  local x, y, z = vars "x y z"
  expect(function() dae { der(x) ~ y, 2*der(x) ~ 2*y }:index() end):fails "the equations depend on each other: one more is needed"
  expect(function() dae { der(x) ~ y, der(x) ~ y + 1 }:index() end):fails "the equations contradict each other"
  expect(function() dae { 0 ~ x*y - 1, 0 ~ x^2*y^2 - 1, der(z) ~ x }:index() end):fails "dependent equations"
end)

test("Kunkel & Mehrmann 2006, Ex. 3.1 and 3.2: the pencil says nothing about systems that depend on t", function()
  local x1, x2 = vars "x1 x2"
  -- E = [-t t²; -1 t], A = -I: regular pencils for all t, and yet x = c(t) (t, 1) solves it for every c
  local free = dae { -t*der(x1) + t^2*der(x2) ~ -x1, -der(x1) + t*der(x2) ~ -x2 }
  expect(function() free:index() end):fails "the equations depend on each other"
  expect(free:structure().valid):equals(false)
  -- E = [0 0; 1 -t], A = [-1 t; 0 0]: singular pencils for all t, and yet x2 = f2 - f1′, x1 = t x2 + f1
  answers(dae { 0 ~ -x1 + t*x2 + sin(t), der(x1) - t*der(x2) ~ cos(t) }, 2, 0)
end)

-- ── fields ──────────────────────────────────────────────────────────────────────────────────────────────────────────

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
