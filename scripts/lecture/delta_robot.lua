-- Lecture 10, the delta robot in Lagrange mechanics. The nacelle p hangs on three long arms of length L; the
-- upper end of arm k sits on a short arm of length l that motor k turns to the angle α_k, at the distance d
-- from the centre.
--
--   ./dev run scripts/lecture/delta_robot.lua

p, alpha, u = var("p", 3), var("alpha", 3), input("u", 3)
m, g, J, L, l, d = params "m=1 g=9.81 J=0.05 L=0.8 l=0.3 d=0.15"

-- Rot(γ_k) (d + l cos α_k, 0, -l sin α_k), γ = 0, 2π/3, 4π/3
function end_point(k)
  local gamma = 2*pi*(k - 1)/3
  local turn = mat { {cos(gamma), -sin(gamma), 0}, {sin(gamma), cos(gamma), 0}, {0, 0, 1} }
  return simplify(turn)*vec { d + l*cos(alpha[k]), 0, -l*sin(alpha[k]) }
end
C = {}
for k = 1, 3 do
  local rod = p - end_point(k)
  C[k] = (rod.T*rod - L^2)/2
end

print "1. Motors with inertia J and torques u"
q = vstack(p, alpha)
robot = lagrange { q = q, T = m/2*p.dot.T*p.dot + J/2*alpha.dot.T*alpha.dot, V = m*g*p[3], C = C,
  Q = vstack(zeros(3, 1), u),
  name = "delta robot" }
print(("index %d, %d differential + %d algebraic variables, %d free initial values"):format(robot:index(),
  #robot.differential,
  #robot.algebraic, robot:dof()))
for k = 1, 3 do print("p" .. k .. "ᴿ =", end_point(k).T) end
print("C1 =", robot.C[1])
assert(robot:index() == 3 and robot:dof() == 6 and #robot:constraints() == 6)

print "The equations of motion, and C′ from the conditions on the start:"
print(robot:trace "short")
print(robot:constraints())

print "\nA start: the nacelle at rest off the centre, no torque. The arms' angles follow (two branches; the guess chooses)."
off = { [u] = vec { 0, 0, 0 } }
at = robot:init { fix = { [p] = {0.05, -0.02, -0.6}, [p.dot] = {0, 0, 0} }, guess = { [alpha] = {0, 0, 0} },
  inputs = off }
print(("α = %.6f %.6f %.6f"):format(at(alpha[1]), at(alpha[2]), at(alpha[3])))
-- roots of C_k found apart
expect(at(alpha)):near({ -0.34935284755, -0.10331377210, -0.19418050391 }, 1e-9)
for k = 1, 3 do expect(at(C[k])):near(0, 1e-10) end

print "\nThe nacelle falls for 0.2 s, computed with four forms of the model"
print "form       p(0.2)                                    energy gained  largest |C|"
for _, form in ipairs { "project", "acc", "baumgarte", "dummy" } do
  local low = robot:reduce(form, form == "dummy" and { at = at } or nil)
  local sol = low:integrate { start = at, to = 0.2, inputs = off, method = rk.gauss(3), dt = 0.01 }
  local where, gained, largest = sol(p, 0.2), sol(robot.energy, 0.2) - sol(robot.energy, 0), 0
  for k = 1, 3 do largest = math.max(largest, math.abs(sol(C[k], 0.2))) end
  print(("%-9s  %.8f  %.8f  %.8f     %s         %s"):format(form, where[1], where[2], where[3],
    math.abs(gained) < 1e-8 and "< 1e-8" or "more", largest < 1e-9 and "< 1e-9" or "more"))
  -- reference: extrapolation of the KKT system written by hand
  expect(where):near({ 0.046683999948, -0.018686847820, -0.663358841436 }, 1e-9)
  expect(gained):near(0, 1e-8)
  expect(largest):near(0, 1e-9)
end

print "\nTorques that hold it: on the vertical, m g/3 for each arm, by virtual work"
-- At p = (0, 0, z) all α are equal and Σ u δα + m g (-δz) = 0. C = 0 gives δz/δα along the vertical.
level = robot:init { fix = { [p] = {0, 0, -0.6}, [p.dot] = {0, 0, 0} }, guess = { [alpha] = {0, 0, 0} },
  inputs = off }
slope = -level(diff(C[1], alpha[1]))/level(diff(C[1], p[3]))                        -- dz/dα of one arm
hold = { [u] = 9.81*slope/3*vec { 1, 1, 1 } }
rest = robot:init { fix = { [p] = {0, 0, -0.6}, [p.dot] = {0, 0, 0} }, guess = { [alpha] = {0, 0, 0} },
  inputs = hold }
print(("u = %.6f N m for each motor; p″ = %.1f %.1f %.1f"):format(9.81*slope/3, math.abs(rest(p[1].ddot)),
  math.abs(rest(p[2].ddot)),
  math.abs(rest(p[3].ddot))))
expect(rest(p.ddot)):near({ 0, 0, 0 }, 1e-9)

print "\n2. Massless motors: J = 0, T without α′"
light = lagrange { q = q, T = m/2*p.dot.T*p.dot, V = m*g*p[3], C = C, Q = vstack(zeros(3, 1), u),
  name = "massless motors" }
print("W ="); print(light.M)
print(("rank of W %d of 6, of [W Cqᵀ; Cq 0] %d of 9: W is singular, but regular on the kernel of ∂C/∂q"):format(rank(light.M),
  rank(light.matrix_form.A)))
print(("index %d, %d free initial values"):format(light:index(), light:dof()))
-- α has no inertia: its rows are the balance of torques, u = (∂C/∂α)ᵀ z, which gives z, and C = 0 gives α.
-- Nothing is differentiated.
assert(rank(light.M) == 3 and rank(light.matrix_form.A) == 9)
assert(light:index() == 1 and light:dof() == 6 and #light:constraints() == 0)
at = light:init { fix = { [p] = {0, 0, -0.6}, [p.dot] = {0, 0, 0} }, guess = { [alpha] = {0, 0, 0} },
  inputs = hold }
expect(at(p.ddot)):near({ 0, 0, 0 }, 1e-9)
print(("the same torques hold it: z = %.6f for each arm"):format(at(light.multipliers[1])))
sol = light:integrate { start = at, to = 1, inputs = hold, method = rk.gauss(3), dt = 0.02 }
print(("after 1 s p = %.6f %.6f %.6f"):format(math.abs(sol(p[1], 1)), math.abs(sol(p[2], 1)), sol(p[3], 1)))
expect(sol(p, 1)):near({ 0, 0, -0.6 }, 1e-8)

print "\nWithout torque massless motors give no force at all: z = 0, and the nacelle falls freely"
at = light:init { fix = { [p] = {0, 0, -0.6}, [p.dot] = {0, 0, 0} }, guess = { [alpha] = {0, 0, 0} },
  inputs = off }
sol = light:integrate { start = at, to = 0.1, inputs = off, method = rk.gauss(3), dt = 0.01 }
print(("p₃(0.1) = %.6f, -0.6 - g t²/2 = %.6f"):format(sol(p[3], 0.1), -0.6 - 9.81*0.005))
expect(sol(p[3], 0.1)):near(-0.6 - 9.81*0.005, 1e-10)
