-- Lecture 10, Lagrange mechanics: cart and pendulum. The slides mix two angles: T has θ from the horizontal
-- (its cross term is
-- -L M θ′x′ sin θ), V = M g L cos θ has it from the vertical. Here both conventions, each with itself, and
-- the print's mixture.
--
--   ./dev run scripts/lecture/cart_pendulum.lua

x, theta, phi = vars "x theta phi"
m, M, L, g = params "m=2 M=1 L=0.5 g=9.81"          -- m on rails, M at the end of the rod

print "θ from the horizontal: M sits at (x + L cos θ, L sin θ)"
p = vec { x + L*cos(theta), L*sin(theta) }
v = der(p)
T = m/2*x.dot^2 + M/2*(v.T*v)
V = M*g*p[2]
print("T =", simplify(expand(T)))
print("V =", V)
lecture_T = (m + M)/2*x.dot^2 + M*L^2/2*theta.dot^2 - L*M*theta.dot*x.dot*sin(theta)
expect(simplify(expand(T - lecture_T))):equals(0)
horizontal = lagrange { q = {x, theta}, T = lecture_T, V = V, name = "θ from the horizontal" }
print "The gradients of the slides, with the right V:"
print(horizontal:trace())
print(horizontal.matrix_form)
expect(horizontal.rhs[2]):equals(-M*g*L*cos(theta))  -- the second right side of the slides with the right V
expect(simplify(horizontal.rhs[1] - M*L*theta.dot^2*cos(theta))):equals(0)

print "\nφ from the vertical: M sits at (x + L sin φ, L cos φ)"
r = vec { x + L*sin(phi), L*cos(phi) }
w = der(r)
vertical = lagrange { q = {x, phi}, T = m/2*x.dot^2 + M/2*(w.T*w), V = M*g*r[2],
  name = "φ from the vertical" }
print(vertical.matrix_form)
expect(simplify(vertical.rhs[2] - M*g*L*sin(phi))):equals(0)

print "\nThe same motion, φ = π/2 - θ:"
start_h = horizontal:init { fix = { [x] = 0, [theta] = 0.5, [x.dot] = 0, [theta.dot] = 0 } }
start_v = vertical:init { fix = { [x] = 0, [phi] = math.pi/2 - 0.5, [x.dot] = 0, [phi.dot] = 0 } }
run = { to = 2, method = rk.gauss(3), dt = 0.005 }
h = horizontal:integrate { start = start_h, to = run.to, method = run.method, dt = run.dt }
vv = vertical:integrate { start = start_v, to = run.to, method = run.method, dt = run.dt }
print(" t     x(t) by θ      x(t) by φ      θ            π/2 - φ")
for _, time in ipairs { 0, 0.5, 1, 1.5, 2 } do
  print(("%.1f  %12.8f  %12.8f  %12.8f  %12.8f"):format(time, h(x, time), vv(x, time), h(theta, time),
    math.pi/2 - vv(phi, time)))
  expect(h(x, time)):near(vv(x, time), 1e-9)
  expect(h(theta, time)):near(math.pi/2 - vv(phi, time), 1e-8)
end
expect(h(x, 2)):near(-0.0156558166224, 1e-9)         -- by extrapolation of the two equations, solved by hand

print "\nWhat stays constant: energy, and the momentum along the rails (V does not contain x)"
momentum = diff(horizontal.T, x.dot)
print("∂T/∂x′ =", momentum)
for _, e in ipairs { horizontal.energy, momentum } do
  print(("%.6f at the start, %.6f after 2 s"):format(h(e, 0), h(e, 2)))
  expect(h(e, 2)):near(h(e, 0), 1e-8)
end

print "\nThe slides' mixture, T of θ and V of φ, describes another system: it is not at rest where M hangs straight down."
mixed = lagrange { q = {x, theta}, T = lecture_T, V = M*g*L*cos(theta), name = "mixed" }
hanging = { [x] = 0, [theta] = -math.pi/2, [x.dot] = 0, [theta.dot] = 0 }
for _, model in ipairs { horizontal, mixed } do
  local at = model:init { fix = hanging }
  print(("%-22s θ″ = %.6f hanging at rest, θ = -π/2"):format(model.name .. ":",
    math.abs(at(theta.ddot)) < 1e-12 and 0 or at(theta.ddot)))
end
expect(horizontal:init { fix = hanging }(theta.ddot)):near(0, 1e-12)
expect(math.abs(mixed:init { fix = hanging }(theta.ddot)) > 1):is_true()
