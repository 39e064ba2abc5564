-- Lecture 10, Lagrange mechanics: a silly example. A mass on a spring.
--
--   ./dev run scripts/lecture/spring.lua

x = var "x"
m, k = params "m=2 k=8"
T, V = m*x.dot^2/2, k*x^2/2

print "By hand, step by step"
L = T - V
print("L =", L)
print("∂L/∂x′ =", diff(L, x.dot))
print("∂L/∂x =", diff(L, x))
print("d/dt ∂L/∂x′ =", der(diff(L, x.dot)))
print("d/dt ∂L/∂x′ - ∂L/∂x =", der(diff(L, x.dot)) - diff(L, x))
expect(der(diff(L, x.dot)) - diff(L, x)):equals(m*der(x, 2) + k*x)

print "\nBy lagrange"
spring = lagrange { q = {x}, T = T, V = V, name = "mass on a spring" }
print(spring:trace())
print(spring)
print(spring.matrix_form)
assert(spring.kind == "ODE" and spring:index() == 0 and spring:dof() == 2)
expect(spring.rhs[1]):equals(-k*x)

print "\nThe exact solution: x = cos ωt with ω = √(k/m) = 2"
exact = spring:pencil():solution { [x] = 1, [x.dot] = 0 }
print("x(t), x′(t) =", exact)
sol = spring:integrate { start = { [x] = 1, [x.dot] = 0 }, to = 10, method = rk.gauss(3), dt = 0.05 }
print(("x(10) = %.8f, cos 20 = %.8f"):format(sol(x, 10), math.cos(20)))
expect(sol(x, 10)):near(math.cos(20), 1e-8)         -- dt⁶ ω⁷ t/100800, 4e-10
print(("energy %.10f at the start, %.10f after 10 s: Gauss methods keep quadratic invariants"):format(
  sol(spring.energy, 0), sol(spring.energy, 10)))
expect(sol(spring.energy, 10)):near(4, 1e-12)

print "\nStationary, not minimal: the action along x = cos 2t + ε sin(π t/T), ends fixed"
-- S(ε) = ∫ L dt from 0 to T has S′(0) = 0. Here S″ = (m (π/T)² - k) T/2: a minimum for T < π/2, none beyond.
eps = param "epsilon"
function action(T_end, value)
  local path = cos(2*t) + eps*sin(pi*t/T_end)
  local along = fn({ t, eps }, subs(L, { [x] = path, [x.dot] = der(path) }))
  local n, sum = 2000, 0                            -- Simpson's rule, exact to about 1e-12 here
  for i = 0, n do
    local weight = (i == 0 or i == n) and 1 or (i % 2 == 1 and 4 or 2)
    sum = sum + weight*along(T_end*i/n, value)
  end
  return sum*T_end/n/3
end
for _, T_end in ipairs { 1, 3 } do
  local low, mid, high = action(T_end, -0.1), action(T_end, 0), action(T_end, 0.1)
  local slope, curvature = (high - low)/0.2, (high - 2*mid + low)/0.01
  print(("T = %d: S′ = %.6f, S″ = %+.6f: %s"):format(T_end, math.abs(slope), curvature,
    curvature > 0 and "a minimum" or "no minimum"))
  expect(slope):near(0, 1e-8)
  expect(curvature):near((2*(math.pi/T_end)^2 - 8)*T_end/2, 1e-6)
end
