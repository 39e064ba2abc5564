-- Lecture 10, external forces: d/dt ∂L/∂q′ - ∂L/∂q = Q with ⟨δq, Q⟩ = δW for all δq, and Q = Σ (∂p/∂q)ᵀ F for
-- forces F at p(q).
--
--   ./dev run scripts/lecture/external_forces.lua

m, M, L, g = params "m=2 M=1 L=0.5 g=9.81"

print "1. Cartesian coordinates: the generalised force is the force"
p, F = var("p", 3), input("F", 3)
Q = generalized_force(p, { {p, F} })
print("Q =", Q)
expect(Q):equals(F)

print "\n2. A pendulum pushed at its tip: the torque"
theta = var "theta"
Fx, Fy = inputs "F_x F_y"
tip = vec { L*sin(theta), -L*cos(theta) }
torque = generalized_force({theta}, { {tip, vec { Fx, Fy }} })
print("Q =", torque)
expect(torque[1]):equals(L*(Fx*cos(theta) + Fy*sin(theta)))
pendulum = lagrange { q = {theta}, T = M*L^2*theta.dot^2/2, V = M*g*tip[2], Q = torque,
  name = "pendulum with a force" }
print(pendulum)
-- Virtual work: δW = F·δp must be Q δθ for every δθ.
delta = param "delta_theta"
work = (jacobian(tip, vec { theta })*delta).T*vec { Fx, Fy }
expect(work):equals(torque[1]*delta)

print "\n3. Cart and pendulum with a motor on the cart, friction, and wind on the mass"
x = var "x"
motor, wind = inputs "u w"
d = param("d", 0.3)
cart, mass = vec { x, 0 }, vec { x + L*sin(theta), -L*cos(theta) }
v = der(mass)
Q = generalized_force({x, theta}, { {cart, vec { motor - d*x.dot, 0 }}, {mass, vec { wind, 0 }} })
print("Q =", Q.T)
expect(Q):equals(vec { motor - d*x.dot + wind, wind*L*cos(theta) })
sys = lagrange { q = {x, theta}, T = m/2*x.dot^2 + M/2*(v.T*v), V = M*g*mass[2], Q = Q,
  name = "cart with motor, friction, wind" }
print(sys:trace())
print(sys.matrix_form)
assert(sys:index() == 0 and sys:dof() == 4)

print "\nThe energy changes by the power of the forces: E(t) - E(0) = ∫ Qᵀq′ dt"
W = var "W"                                          -- the work, integrated along
wide = dae { der(x, 2)*(m + M) + M*L*cos(theta)*der(theta, 2) ~ M*L*theta.dot^2*sin(theta) + Q[1],
  M*L*cos(theta)*der(x, 2) + M*L^2*der(theta, 2) ~ -M*g*L*sin(theta) + Q[2],
  der(W) ~ Q[1]*x.dot + Q[2]*theta.dot, name = "with the work as a variable" }
blow = { [motor] = 2*sin(3*t), [wind] = cos(t)/2 }
start = { [x] = 0, [theta] = 0.4, [x.dot] = 0, [theta.dot] = 0 }
sol = sys:integrate { start = start, to = 5, inputs = blow, method = rk.gauss(3), dt = 0.01 }
start[W] = 0
along = wide:integrate { start = start, to = 5, inputs = blow, method = rk.gauss(3), dt = 0.01 }
gain = sol(sys.energy, 5) - sol(sys.energy, 0)
print(("gain of energy %.8f J, work %.8f J"):format(gain, along(W, 5)))
expect(gain):near(along(W, 5), 1e-8)
expect(along(x, 5)):near(sol(x, 5), 1e-10)           -- equations by lagrange and by hand

print "\n4. A constraint force does no work: it lies in the space of the gradients of c, z ∇c, and c′ = ∇cᵀq′ = 0"
q = var("q", 2)
bead = lagrange { q = q, T = m/2*q.dot.T*q.dot, V = m*g*q[2], C = { q[2] - q[1]^2 },
  name = "bead on a parabola" }
print(bead)
force = -(bead.dCdq.T*bead.multipliers)
print("constraint force -(∂C/∂q)ᵀ z =", force)
at = bead:init { fix = { [q[1]] = 1, [q[1].dot] = 0.5 }, guess = { [q[2]] = 1 } }
print(("its power at the start: %.1f;  z = %.6f"):format(math.abs(at(force.T*q.dot)), at(bead.multipliers)))
expect(at(force.T*q.dot)):near(0, 1e-12)
-- By hand: q₂ = q₁², q₁ = 1, q₁′ = 1/2: (1 + 4 q₁²) q₁″ = -4 q₁ q₁′² - 2 g q₁, so q₁″ = -(1 + 19.62)/5, z = m
-- q₁″/(2 q₁).
expect(at(q[1].ddot)):near(-(1 + 19.62)/5, 1e-10)
expect(at(bead.multipliers)):near(2*(-(1 + 19.62)/5)/2, 1e-10)
