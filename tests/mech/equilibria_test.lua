-- Equilibria of mechanisms with constraints: every form has those of the model, with the same characteristic
-- polynomial.
local m, g, l, k = params "m g l k"
local m1, m2, F = params "m1 m2 F"

local function modes(model) return equilibria(model) end

test("a pendulum in Cartesian coordinates, as it stands and in every form", function()
  local p = var("p", 2)
  local pendulum = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*p[2], C = { (p.T*p - l^2)/2 } }
  local all = { pendulum }
  for _, form in ipairs { "acc", "ggl", "project", "ode" } do all[#all + 1] = pendulum:reduce(form) end
  for _, model in ipairs(all) do
    local found = modes(model)
    expect(#found):equals(2)
    expect(found[1].modes):equals "det(s E - A) = s² + g/l"
    expect(found[2].modes):equals "det(s E - A) = s² - g/l"
    expect(found[1][p[2]] == -l):equals(true)
    expect(found[2].verdict):matches "unstable where g l > 0"
  end
  local stabilised = modes(pendulum:reduce "baumgarte")
  expect(stabilised[2].verdict):matches "^unstable where g l > 0; else not decided"
  local dummy = modes(pendulum:reduce "dummy")
  expect(#dummy):equals(2)
  expect(dummy[1].verdict):matches "singular here"
end)

test("numbers: eigenvalues instead of conditions, ten times larger, with friction", function()
  local p, d = var("p", 2), param("d", 3)
  local pendulum = lagrange { q = p, T = p.dot.T*p.dot/2, V = 9.81*p[2], C = { (p.T*p - 100)/2 },
    Q = -d*p.dot }
  local found = equilibria(pendulum, { params = true })
  expect(found[1].stable):equals(true)
  expect(found[2].stable):equals(false)
  local low = equilibria(pendulum:reduce("minimal", { at = pendulum:init { fix = { p = { 0, -10 },
    [p.dot] = { 0, 0 } } } }), { params = true })
  local one, other = found[1].eigenvalues, low[1].eigenvalues
  for i = 1, 2 do
    expect(one.re[i]):near(other.re[i], 1e-9)
    expect(math.abs(one.im[i])):near(math.abs(other.im[i]), 1e-9)
  end
end)

test("a rod between two masses with a spring: the mode of the sum of the masses", function()
  local x1, x2 = vars "x1 x2"
  local rod = lagrange { q = { x1, x2 }, T = m1/2*x1.dot^2 + m2/2*x2.dot^2, V = k/2*x1^2, C = { x1 - x2 - l },
    Q = { F, 0 } }
  for _, model in ipairs { rod, rod:reduce "ggl", rod:reduce "ode", rod:reduce "acc" } do
    local found = equilibria(model)
    expect(#found):equals(1)
    expect(found[1].modes):equals "det(s E - A) = s² + k/(m₁ + m₂)"
    expect(found[1][x2] == F/k - l):equals(true)
  end
  expect(equilibria(rod:reduce "dummy")[1].modes):equals "det(s I - A) = s² + k/(m₁ + m₂)"
  expect(equilibria(rod:reduce "minimal")[1].modes):equals "det(s I - A) = s² + k/(m₁ + m₂)"
end)

test("DAEs of index 2 and implicit equations", function()
  local x, y, z = vars "x y z"
  local servo = equilibria(dae { der(x) ~ y - x^3, der(y) ~ z, 0 ~ y - 2*x })
  expect(#servo):equals(3)
  expect(servo[1].modes .. servo[2].modes):matches "det%(s E %- A%) = s %- 2"
  local coupled = equilibria(dae { der(x) + der(y) ~ x - 1, der(x) - der(y) ~ y })
  expect(coupled[1].modes or tostring(coupled[1].eigenvalues)):matches "1"
end)

test("roots that only Cardano writes keep their names: the equation of the root is told", function()
  local x, y = vars "x y"
  local a, b = params "a b"
  local cubic = equilibria(dae { der(x) ~ x^3 + a*x + b })
  expect(tostring(cubic)):matches "x with x³ %+ a x %+ b = 0\n     A = 3 x² %+ a"
  expect(cubic[1].verdict):equals "asymptotically stable where 3 x² + a < 0"
  expect(cubic:latex()):matches "x%^3 %+ a x %+ b = 0"
  local duffing = equilibria(dae { der(x) ~ y, der(y) ~ -k*y - x^3 + x + a })
  expect(duffing[1].verdict):equals "asymptotically stable where k > 0, 3 x² - 1 > 0"
  expect(tostring(solve({ x^3 + a*x + b, y - x }, { x, y }))):equals "x = y,  y with y³ + a y + b = 0"
  expect(tostring(roots(x^3 + a*x + b, x))):matches "D = a³/27"
  expect(#equilibria(dae { der(x) ~ x^3 - 3*x + 1 })):equals(3)      -- numbers: all three are written
  expect(#equilibria(dae { der(x) ~ a*x - x^3 })):equals(3)
  expect(#solve({ x^2 + a, y - 1 }, { x, y })):equals(2)             -- real where a < 0
end)

-- An algebraic equation with its variable on the left was left out: "d free".
test("algebraic equations count on whichever side their variable stands", function()
  local d, w, P = vars "d w P"
  local forms = { P ~ 2.2*sin(d), 2.2*sin(d) ~ P, 0 ~ 2.2*sin(d) - P, 2.2*sin(d) - P ~ 0, 2*P ~ 4.4*sin(d) }
  for _, power in ipairs(forms) do
    local points = equilibria(dae{ der(d) ~ w, 0.026*der(w) ~ 0.8 - P - 0.01*w, power })
    expect(#points):equals(2)
    expect(evaluate(points[1].d)):near(math.asin(0.8/2.2), 1e-14)
    expect(evaluate(points[1].P)):near(0.8, 1e-14)
    expect(points[1].stable):equals(true)
    expect(points[2].stable):equals(false)
  end
  local at = equilibria(dae{ der(d) ~ 1 - P, P ~ d^3 })
  expect(tostring(at[1])):matches "d = 1,  P = 1"
  expect(tostring(explain_step(dae{ der(d) ~ 1 - P, P ~ d^3 }, rk.radau(1)))):matches "g_x = 3 d²"
end)
