-- structure(): Σ, offsets and the verdict, on models whose answer is known (scripts/exam/problem3.lua (d);
-- Pryce 2001).

test("the planar pendulum: c = (0,0,2), d = (2,2,0), index 3, two free initial values, valid", function()
  local x, y, lam = vars "x y lambda"
  local g, L = params "g=9.81 L=1"
  local s = dae { der(x, 2) ~ -lam*x, der(y, 2) ~ -lam*y - g, 0 ~ x^2 + y^2 - L^2 }:structure()
  expect(s.c):equals { 0, 0, 2 }
  expect(s.d):equals { 2, 2, 0 }
  expect(s.structural_index):equals(3)
  expect(s.structural_dof):equals(2)
  expect(s.index):equals(3)
  expect(s.dof):equals(2)
  expect(s.verdict):equals("valid")
  expect(s.valid):equals(true)
end)

test("exam 3(d): structure says index 0 and three free values; the system Jacobian is identically singular",
  function()
  local s = dae.linear { E = { {1,1,0}, {0,0,1}, {1,1,1} }, A = eye(3) }:structure()
  expect(s.structural_index):equals(0)
  expect(s.structural_dof):equals(3)
  expect(s.verdict):equals("identically singular")
  expect(s.valid):equals(false)
end)

test("over- and under-determined parts are named", function()
  local x, y, z = vars "x y z"
  local s = dae { der(x) ~ y, 0 ~ x - 1, 0 ~ x - sin(t) }:structure()
  expect(s.verdict):equals("structurally singular")
  local text = tostring(dae { 0 ~ x - 1, 0 ~ x^2 - t, der(y) ~ z }:structure())
  expect(text:find("over-determined: 2 equations (1), (2) for 1 unknown x", 1, true) ~= nil):equals(true)
  expect(text:find("under-determined: 1 equation (3) for 2 unknowns y, z", 1, true) ~= nil):equals(true)
end)

test("sin² + cos² = 1 does not hide a singular Jacobian", function()
  local x, y, th = vars "x y theta"
  -- the second equation is the first again, in disguise
  local s = dae { 0 ~ x*(sin(th)^2 + cos(th)^2) + y, 0 ~ x + y, der(th) ~ x }:structure()
  expect(s.verdict):equals("identically singular")
end)

-- ── the truth, also where structure lies ───────────────────────────────────────────────────────────────────

test("exam 3(d): index 2, one free value, constraints 0 = x1 + x2 - x3 and 0 = x1 - x2, x = α e^{t/2} (1, 1, 2)", function()
  local s = dae.linear { E = { {1,1,0}, {0,0,1}, {1,1,1} }, A = eye(3) }
  expect(s:index()):equals(2)
  expect(s:dof()):equals(1)
  expect(tostring(s:constraints()):find("0 = x₁ + x₂ - x₃", 1, true) ~= nil):equals(true)
  expect(tostring(s:constraints()):find("0 = x₁ - x₂", 1, true) ~= nil):equals(true)
  local at = s:init { fix = { x1 = 1 } }
  expect(at(vec{var "x2", var "x3"})):near({1, 2}, 1e-10)
  local sol = s:reduce("acc"):integrate { start = at, to = 2, method = rk.gauss(3), dt = 0.1 }
  expect(sol(var "x3", 2)):near(2*math.exp(1), 1e-9)     -- dt⁶ · e · 20 steps, generously
end)

test("the lecture's nilpotent E: index 3, nothing free, x = (-u″, -u′, -u)", function()
  local u = input "u"
  local s = dae.linear { E = { {0,1,0}, {0,0,1}, {0,0,0} }, A = eye(3), B = { {0}, {0}, {1} }, u = u }
  expect(s:index()):equals(3)
  expect(s:dof()):equals(0)
  local at = s:init { inputs = { [u] = sin(t) }, from = 1 }
  expect(at(vec{var "x1", var "x2", var "x3"})):near({math.sin(1), -math.cos(1), -math.sin(1)}, 1e-10)
end)

test("structural index 3, true index 1, two free values", function()
  local x1, x2, x3, x4, x5 = vars "x1 x2 x3 x4 x5"
  local s = dae { der(x2) + der(x3) + x1 ~ sin(t), der(x2) + der(x3) + x2 ~ cos(t),
                  der(x4) + der(x5) + x3 ~ t, der(x4) + der(x5) + x4 ~ 0, x5 ~ t^2 }
  expect(s:structure().structural_index):equals(3)
  expect(s:structure().index):equals(1)
  expect(s:index()):equals(1)
  expect(s:dof()):equals(2)
end)

test("-x″ - y = sin t, x″ + x + y = t: index 3, x = t + sin t, y = 0", function()
  local x, y = vars "x y"
  local s = dae { -der(x, 2) - y ~ sin(t), der(x, 2) + x + y ~ t }
  expect(s:index()):equals(3)
  expect(s:dof()):equals(0)
  local at = s:init { from = 0.7 }
  expect(at(x)):near(0.7 + math.sin(0.7), 1e-10)
  expect(at(y)):near(0, 1e-10)
end)

test("the isothermal CSTR of the lecture: index 2, three free values, R1 as in the errata", function()
  local V, CA, CB, CC, R1, R2 = vars "V C_A C_B C_C R_1 R_2"
  local Fa, F, CA0, Keq, k2 = params "F_a=1 F=0.5 C_A0=2 K_eq=3 k_2=0.4"
  local s = dae { der(V) ~ Fa - F, der(CA) ~ Fa/V*(CA0 - CA) - R1, der(CB) ~ -Fa/V*CB + R1 - R2,
    der(CC) ~ -Fa/V*CC + R2,
                  0 ~ CA - CB/Keq, 0 ~ R2 - k2*CB }
  expect(s:index()):equals(2)
  expect(s:dof()):equals(3)
  local at = s:init { fix = { V = 2, C_B = 1.5, C_C = 0.1 }, guess = { R_1 = 1 } }
  expect(at(R1)):near((3*1*2/2 + 0.4*1.5)/(1 + 3), 1e-9)
end)

test("the transistor amplifier: index 1, five of eight values free", function()
  local y = var("y", 8)
  local function g(x) return 1e-6*(exp(x/0.026) - 1) end
  local Ue, Ub, a = 0.1*sin(200*pi*t), 6, 0.99
  local C = { 1e-6, 2e-6, 3e-6, 4e-6, 5e-6 }
  local s = dae {
    -C[1]*der(y[1]) + C[1]*der(y[2]) ~ (y[1] - Ue)/1000,
    C[1]*der(y[1]) - C[1]*der(y[2]) ~ y[2]/9000 + (y[2] - Ub)/9000 + (1 - a)*g(y[2] - y[3]),
    -C[2]*der(y[3]) ~ y[3]/9000 - g(y[2] - y[3]),
    -C[3]*der(y[4]) + C[3]*der(y[5]) ~ (y[4] - Ub)/9000 + a*g(y[2] - y[3]),
    C[3]*der(y[4]) - C[3]*der(y[5]) ~ y[5]/9000 + (y[5] - Ub)/9000 + (1 - a)*g(y[5] - y[6]),
    -C[4]*der(y[6]) ~ y[6]/9000 - g(y[5] - y[6]),
    -C[5]*der(y[7]) + C[5]*der(y[8]) ~ (y[7] - Ub)/9000 + a*g(y[5] - y[6]),
    C[5]*der(y[7]) - C[5]*der(y[8]) ~ y[8]/9000,
  }
  expect(s:index()):equals(1)
  expect(s:dof()):equals(5)
  expect(#s:constraints()):equals(3)
end)

test("branches: an index-1 model whose equations have a singular solution too is still index 1", function()
  local x, y = vars "x y"
  local circle = dae { der(x) ~ -x*y, 0 ~ y^2 + x^2 - 1 }
  expect(circle:index()):equals(1)
  expect(circle:dof()):equals(1)
  expect(dae { der(x) ~ y, 0 ~ -y^3 - x }:index()):equals(1)
end)

test("lists of the report print, and a start can be given as it is", function()
  local x, z = var("x", 2), var "z"
  local sys = dae { der(x[1]) ~ z, der(x[2]) ~ x[1], 0 ~ z^3 + z - x[2]^2 }
  local s = sys:structure()
  expect(tostring(s.c)):equals("0  0  0")
  expect(tostring(s.sigma)):equals("1  ·  0\n0  1  ·\n·  0  0")
  expect(tostring(s.blocks[1])):equals("z  for  (3)")
  expect(tostring(s.over)):equals("none")
  expect(s.jacobian):equals(s.J)
  local at = sys:init { fix = { [x] = { 1, 1 } } }
  expect(sys:structure(at).gap):near(sys:structure{ at = at }.gap, 0)
end)

test("a consistent point where det J vanishes is found at any time", function()
  local x, z = vars "x z"
  local text = tostring(dae { der(x) ~ 1, 0 ~ z*(x - 1) - sin(t) }:structure())     -- x = 1 at t = 0
  expect(text:find("singular points: there are consistent points with 1 - x = 0", 1, true) ~= nil):is_true()
end)

test("unknowns are listed as they were declared, whatever was declared before", function()
  local v, u = vars "v u"
  local x, y, u2, v2 = vars "x y u v"
  local sys = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -x, der(v) ~ -y }
  expect(tostring(sys.differential.T)):equals("[x  y  u  v]")
  local again = var "x"                              -- declaring one of them again moves nothing
  expect(tostring(sys.differential.T)):equals("[x  y  u  v]")
end)

test("a nonlinear model whose structural index is too high: the derivative array is asked further down",
  function()
  local x = var("x", 5)
  local sys = dae { der(x[2]) + der(x[3]) + x[1] ~ sin(t), der(x[2]) + der(x[3]) + x[2] ~ cos(t),
    der(x[4]) + der(x[5]) + x[3] ~ t, der(x[4]) + der(x[5]) + x[4] ~ 1, x[5] + x[5]^3 ~ exp(-t) }
  local s = sys:structure()
  expect(s.structural_index):equals(3)
  expect(sys:index()):equals(1)
  expect(sys:dof()):equals(2)
  local ball = var "z"
  -- index 0 has nothing to confirm
  local bound = tostring(dae { der(ball)^3 ~ ball + 2 }:structure())
  expect(bound):matches "true index 0"
end)

-- log 0 and √-1 have no value: that a factor vanishes at p = 0 is not asked
test("coefficients that are logarithms and roots of parameters", function()
  local x, y, p = var "x", var "y", param("p", 2)
  for _, c in ipairs { log(p), log(p) - 1, sqrt(p - 1), asin(p/4) } do
    local text = tostring(dae { c*der(x) ~ -x + y, 0 ~ (c + 2)*y - x }:structure())
    expect(text):matches "structural index 1"
    expect(text):matches "≠ 0"
  end
end)
