-- Lecture 10, a first view on approaching DAEs numerically: z = ξ(x, u) by the implicit function theorem and
-- Newton's method, M(x) [x′; z] = f, implicit Euler and BDF.
--
--   ./dev run scripts/lecture/semi_explicit.lua

x, z, u = var "x", var "z", input "u"

print "1. The implicit function theorem: 0 = G(x, z, u) gives z = ξ(x, u) where ∂G/∂z is regular"
G = z^3 + z - x - u
print("G =", G)
print("∂G/∂z =", diff(G, z), " > 0 for every z: ξ exists everywhere")
print("∂ξ/∂x = -(∂G/∂z)⁻¹ ∂G/∂x =", implicit_jacobian({ G }, { z }, { x }))
model = dae { der(x) ~ u - x + z, 0 ~ G }
print(model)
print "Newton's method for z at x = 1, u = 0:"
print(newton { r = { subs(G, { [x] = 1, [u] = 0 }) }, x = { z }, start = { 1 } })

print "\n2. A linear system for [x′; z]: M(x) [x′; z] = f, here the 3-D pendulum after two differentiations"
p = var("p", 3)
m, g, L = params "m=1 g=9.81 L=1"
pendulum = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*p[3], C = { (p.T*p - L^2)/2 } }
form = pendulum.matrix_form
print(form)
print("det M =", det(form.A), " regular on the sphere pᵀp = L²")
v, lambda = var("v", 3), var "z"
F = vstack(p.dot - v, m*v.dot + m*g*vec { 0, 0, 1 } + lambda*p, vec { (p.T*p - L^2)/2 })
J = jacobian(F, vstack(p.dot, v.dot, vec { lambda }))
print(("before the differentiations: ∂F/∂(x′, z) has rank %d of %d, so z is not determined"):format(rank(J),
  J.rows))
expect(rank(J)):equals(6)
low = pendulum:reduce "acc"
print(low:trace())
print(pendulum:reduce "ode")
print "Solved numerically in every evaluation, it gives x′ for an ODE method, and z as a by-product."

print "\n3. Implicit Euler and BDF for x′ = F(x, z, u), 0 = G(x, z, u)"
print(explain_step(model, bdf(1)))
print ""
print(explain_step(model, bdf(2)))
print "\nThe BDF formulas 1 … 6"
for k = 1, 6 do print((tostring(bdf(k)):match "\n\n([^\n]*)")) end
print "\nImplicit Euler is BDF 1, and the tableau"
print(rk.implicit_euler)

print "\nx(1) from x(0) = 1, u = 0: errors by the step"
start = model:init { fix = { [x] = 1 }, guess = { [z] = 1 }, inputs = { [u] = 0 } }
fine = model:integrate { start = start, to = 1, inputs = { [u] = 0 }, rtol = 1e-11, atol = 1e-11 }
for _, dt in ipairs { 0.1, 0.05, 0.025 } do
  local sol = model:integrate { start = start, to = 1, inputs = { [u] = 0 }, method = rk.implicit_euler,
    dt = dt }
  print(("dt = %.3f  error %.2e"):format(dt, math.abs(sol:final(x) - fine:final(x))))
end
