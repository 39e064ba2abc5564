-- Lecture 10, the 3-D pendulum: as Newton would write it, by Lagrange, and with the constraint with and
-- without its factor ½.
--
--   ./dev run scripts/lecture/pendulum3d.lua

p, v, z, u = var("p", 3), var("v", 3), var "z", input("u", 3)
m, g, L = params "m=1 g=9.81 L=1"
e3 = vec { 0, 0, 1 }

print "By hand: m p″ = u - m g e₃ - z p on the sphere pᵀp = L²"
newton_form = dae { der(p) ~ v, m*der(v) ~ u - m*g*e3 - z*p, 0 ~ (p.T*p - L^2)/2, name = "3-D pendulum" }
print(newton_form)

print "\nBy Lagrange: L = m/2 p′ᵀp′ - m g e₃ᵀp - z (pᵀp - L²)/2, and the force u at p"
half = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*(e3.T*p), C = { (p.T*p - L^2)/2 },
  Q = generalized_force(p, { {p, u} }),
  name = "with ½" }
print(half)
print(half.matrix_form)
whole = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*(e3.T*p), C = { p.T*p - L^2 }, Q = u,
  name = "without ½" }

print "\nSemi-explicit, and G does not depend on z: ∂G/∂z = 0 does not have full rank, so G = 0 cannot be solved for z = ξ(x, u)"
print("∂G/∂z =", diff((p.T*p - L^2)/2, z))
for _, model in ipairs { newton_form, half, whole } do
  print(("%-14s index %d, %d differential + %d algebraic variables, %d free initial values"):format(model.name
    .. ":",
    model:index(), #model.differential, #model.algebraic, model:dof()))
  assert(model:index() == 3 and model:dof() == 4 and #model:constraints() == 2)
end
print(half:constraints())
print "\nAfter two differentiations: the multiplier as on the slide, z = (m vᵀv - m g p₃ + uᵀp)/L²"
print(half:reduce "acc":trace())

print "\nThe multiplier without ½ is half of the one with ½; the motion is the same"
zero = { [u] = vec { 0, 0, 0 } }
fix = { [p] = {1, 0, 0}, [p.dot] = {0, 1, 0} }
a = half:init { fix = fix, inputs = zero }
b = whole:init { fix = fix, inputs = zero }
c = newton_form:init { fix = { [p] = {1, 0, 0}, [v] = {0, 1, 0} }, inputs = zero }
print(("z = %.6f with ½, %.6f without, %.6f by hand"):format(a(half.multipliers), b(whole.multipliers), c(z)))
expect(a(half.multipliers)):near(1, 1e-10)            -- m (v² - g p₃)/L²
expect(b(whole.multipliers)):near(0.5, 1e-10)
expect(c(z)):near(1, 1e-10)

print "\nTwo seconds of the motion, by three forms"
function run(model, start, form)
  return model:reduce(form):integrate { start = start, to = 2, inputs = zero, method = rk.gauss(3),
    dt = 0.01 }
end
angular = m*(p[1]*p[2].dot - p[2]*p[1].dot)           -- about the vertical
for _, case in ipairs { { half, a, "project" }, { half, a, "acc" }, { whole, b, "project" } } do
  local model, start, form = table.unpack(case)
  local sol = run(model, start, form)
  local where = sol(p, 2)
  print(("%-10s %-8s p(2) = %.8f %.8f %.8f, energy %.6f, angular momentum %.6f"):format(model.name, form,
    where[1], where[2], where[3], sol(model.energy, 2), sol(angular, 2)))
  expect(where):near({ 0.579251157202, 0.588246716733, -0.564299474688 }, 1e-8)
  expect(sol(model.energy, 2)):near(0.5, 1e-8)
  expect(sol(angular, 2)):near(1, 1e-8)
end

print "\nThe force u = m g e₃ balances the weight: a free particle on the sphere moves on a great circle at constant speed"
carried = { [u] = vec { 0, 0, 9.81 } }
at = half:init { fix = fix, inputs = carried }
sol = half:reduce():integrate { start = at, to = math.pi/2, inputs = carried, method = rk.gauss(3),
  dt = math.pi/200 }
print(("a quarter of a turn later p = %.6f %.6f %.6f"):format(math.abs(sol(p[1], math.pi/2)),
  sol(p[2], math.pi/2), math.abs(sol(p[3], math.pi/2))))
expect(sol(p, math.pi/2)):near({ 0, 1, 0 }, 1e-9)
