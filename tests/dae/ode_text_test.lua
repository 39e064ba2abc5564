-- What form "ode" and form "array" print: multipliers and derivatives under the names that the user knows.

local function has(text, part)
  if not text:find(part, 1, true) then error(text .. "\n  does not contain\n" .. part, 2) end
end

local function rods(n)
  local m, g, L = params "m=1 g=9.81 L=1"
  local q, C, height = var("q", 2*n), {}, 0
  for k = 1, n do
    local tip, root = q:slice(2*k - 1, 2*k), k > 1 and q:slice(2*k - 3, 2*k - 2) or vec { 0, 0 }
    C[k] = (norm(tip - root)^2 - L^2)/2
    height = height + q[2*k]
  end
  return lagrange { q = q, T = m/2*q.dot.T*q.dot, V = m*g*height, C = C }, q
end

test("an ODE whose multipliers are not written out names them, with the system that they solve", function()
  local chain = rods(3)
  local ode = chain:reduce "ode"
  local text = tostring(ode)
  has(text, "q₅″ = -z₃ (q₅ - q₃)/m")
  has(text, "where A z = b with")
  has(text, "A = ⎡")
  expect(text:find("A⁻¹b", 1, true) == nil):is_true()
  local latex = ode:latex()
  has(latex, "\\ddot{q}_5 &= -\\frac{z_3 \\left(q_5 - q_3\\right)}{m}")
  has(latex, "where $A \\mathbf{z} = b$")
end)

test("A and b that are printed give the multipliers of the start", function()
  local chain, q = rods(3)
  local at = chain:reduce "ode":init { fix = { [q] = { 0.6, -0.8, 1.2, -1.6, 1.8, -2.4 },
    [q.dot] = { 0.8, 0.6, 0.8, 0.6, 0, 0 } }, nearest = true }
  local p1, d, e = q:slice(1, 2), q:slice(1, 2) - q:slice(3, 4), q:slice(3, 4) - q:slice(5, 6)
  local A = mat { { p1.T*p1, p1.T*d, 0 }, { p1.T*d, 2*d.T*d, -d.T*e }, { 0, -d.T*e, 2*e.T*e } }   -- m = 1
  local b = vec { p1.dot.T*p1.dot - 9.81*q[2], d.dot.T*d.dot, e.dot.T*e.dot }
  expect(at(A*chain.multipliers - b)):near({ 0, 0, 0 }, 1e-9)          -- the start is solved to 1e-10
  has(tostring(chain:reduce "ode"), "p1ᵀp1/m")
end)

test("a mass matrix that is not inverted in symbols is printed with the accelerations", function()
  local a = var("a", 3)
  local x, y, T, V = 0, 0, 0, 0
  for i = 1, 3 do
    x, y = x + sin(a[i]), y - cos(a[i])
    T, V = T + (der(x)^2 + der(y)^2)/2, V + y
  end
  local text = tostring(lagrange { q = a, T = T, V = V }:reduce "ode")
  has(text, "where A a″ = b with")
  has(text, "2 cos(a₁ - a₂)")
end)

test("a large system is not written out, but its size is said", function()
  has(tostring(problems.chain():reduce "ode"), "where A z = b, 10 equations, solved at every evaluation")
end)

test("derivatives that form array makes unknowns are printed as derivatives", function()
  local x, y, z = vars "x y z"
  local sys = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local low = sys:reduce "array"
  has(tostring(low), "x′ = v_x")
  has(tostring(low), "the derivatives among them are unknowns of their own")
  has(low:latex(), "\\dot{x} &= v_x")
  local at = low:init { fix = { x = 0.6, [x.dot] = 0.8 }, guess = { y = -0.8, z = 1 } }
  expect(at:ledger()):matches "x′ +0.8  fixed"
  expect(function()
    low:integrate { start = at, to = 2, events = { { when = x, reset = { [x.dot] = -x.dot } } } }
  end):fails "an event cannot reset x′: it is not a state of the model (its states: v_x, v_y)"
end)

test("a symbol of the user keeps its name", function()
  local w_dot = param("w_dot", 2)
  local w, z = vars "w z"
  local own = var "u_dot"
  dae { der(w) ~ z, 0 ~ w - sin(t) }:reduce "array"
  expect(tostring(w_dot)):equals "w_dot"
  expect(tostring(own)):equals "u_dot"
end)

test("short solutions of the linear system are written out: Michaelis and Menten's rate", function()
  local S, E, C, P = vars "S E C P"
  local k1, km, k2, E0 = params "k1 k_m k2 E0"
  local sys = dae { der(S) ~ -k1*E*S + km*C, 0 ~ k1*E*S - (km + k2)*C, der(P) ~ k2*C, 0 ~ E + C - E0 }
  has(tostring(sys:reduce "ode"), "C = k₁ E₀ S/(k₁ S + k_m + k₂)")
end)

test("conditions that are equations of the model are named by their numbers", function()
  local x, z = vars "x z"
  local low = dae { der(x) ~ z, 0 ~ x - sin(t) }:reduce "acc"
  has(tostring(low), "start must keep  (2)")
  has(tostring(low:trace()), "The new model no longer imposes (2): the start must satisfy it.")
  expect(tostring(low):find("(2) = 0", 1, true) == nil):is_true()
end)

test("derivatives of an eliminated multiplier are values of a start and of a solution", function()
  local p = var("p", 2)
  local m, g, L = params "m=1 g=9.81 L=1"
  local sys = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*p[2], C = { (p.T*p - L^2)/2 } }
  local z = sys.multipliers[1]              -- z = m (v² - g p₂)/L², z′ = -3 m g p₂′/L² since (v²)′ = -2 g p₂′
  for _, form in ipairs { "acc", "ode", "project", "dummy" } do
    local low = sys:reduce(form)
    local at = low:init { fix = { [p[1]] = 0.6, [p[1].dot] = 0.8 }, guess = { [p[2]] = -0.8 } }
    expect(at(z.dot)):near(-3*9.81*0.6, 1e-9)                  -- p₂′ = 0.6 keeps the length
    expect(at(der(z, 2))):near(at(-3*9.81*p[2].ddot), 1e-7)
  end
  local ode = sys:reduce "ode"
  local at = ode:init { fix = { [p[1]] = 0.6, [p[1].dot] = 0.8 }, guess = { [p[2]] = -0.8 } }
  local sol = ode:integrate { start = at, to = 1, rtol = 1e-10, atol = 1e-10 }
  expect(sol(z.dot, 0.5)):near(sol(-3*9.81*p[2].dot, 0.5), 1e-7)
end)

test("a condition names the row that it came from", function()
  local text = tostring(rods(2):constraints())
  has(text, "from (2a)")
  has(text, "(2b) differentiated")
end)
