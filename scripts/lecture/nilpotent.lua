-- Lecture 10, DAEs are not "just" ODEs with an algebraic extension: E x′ = x + B u with a nilpotent E, and
-- implicit Euler on it.
--
--   ./dev run scripts/lecture/nilpotent.lua

x, u = var("x", 3), input "u"
E = mat { {0, 1, 0}, {0, 0, 1}, {0, 0, 0} }
sys = dae.linear { E = E, A = eye(3), B = { {0}, {0}, {1} }, x = x, u = u, name = "nilpotent E" }
print(sys)
print("E² ="); print(E*E)
print("E³ ="); print(E*E*E)
print(sys:structure())
print(sys:pencil())
expect(sys:index()):equals(3)
expect(sys:dof()):equals(0)
expect(E*E*E):equals(zeros(3, 3))

print "\nThe solution is the input and its derivatives; nothing is free"
print("x(t) =", sys:pencil():solution({}, { inputs = { [u] = sin(t) } }), "for u = sin t")
at = sys:init { inputs = { [u] = sin(t) }, from = 1 }
print(at:ledger())
expect(at(x)):near({ math.sin(1), -math.cos(1), -math.sin(1) }, 1e-10)

-- Implicit Euler: E (x⁺ - x)/h = x⁺ + B u(t + h), so (E/h - I) x⁺ = E x/h + B u(t + h).
-- The matrix tends to a singular one, E, times 1/h: its inverse grows like 1/h².
print "\nImplicit Euler with constant steps from t = 1, by hand"
function euler(h, steps, start)
  local now, values = start, {}
  for k = 1, steps do
    local input = vec { 0, 0, math.sin(1 + k*h) }
    now = solve(E/h - eye(3), E*now/h + input)
    values[k] = now
  end
  return values
end
function exact(time) return vec { math.sin(time), -math.cos(time), -math.sin(time) } end
function errors(h, start)
  local row = {}
  for k, value in ipairs(euler(h, 3, start)) do
    local e = value - exact(1 + k*h)
    row[k] = { math.abs(e[1]), math.abs(e[2]), math.abs(e[3]) }
  end
  return row
end
function slopes(list, h)                            -- observed powers of h between consecutive rows
  return math.log(list[#list]/list[#list - 1])/math.log(h[#h]/h[#h - 1])
end
h = { 0.1, 0.05, 0.025, 0.0125, 0.00625 }

print "consistent start x(1) = (-u″, -u′, -u)"
print "   h        |e₁| step 1   step 2      step 3      |e₂| step 1   step 2"
first, second, third, e21, e22 = {}, {}, {}, {}, {}
for i, step in ipairs(h) do
  local row = errors(step, exact(1))
  first[i], second[i], third[i], e21[i], e22[i] = row[1][1], row[2][1], row[3][1], row[1][2], row[2][2]
  print(("%.5f    %.6f      %.6f    %.6f    %.6f      %.6f"):format(step, first[i], second[i], third[i],
    e21[i], e22[i]))
end
print(("order       %.2f          %.2f        %.2f        %.2f          %.2f"):format(math.abs(slopes(first,
  h)), slopes(second, h),
  slopes(third, h), slopes(e21, h), slopes(e22, h)))
print "The error of x₁ is O(1) in the first step and O(h) from the second on; x₃ = -u is exact."
-- x₁ after one step is a second difference with one node of the wrong kind: the error tends to |u″(1)|/2 =
-- sin(1)/2.
expect(first[5]):near(math.sin(1)/2, 0.01)
expect(slopes(first, h)):near(0, 0.05)
expect(slopes(second, h)):near(1, 0.05)
expect(slopes(third, h)):near(1, 0.05)
expect(slopes(e21, h)):near(1, 0.05)

print "\ninconsistent start: x₃(1) wrong by 0.01"
print "   h        |e₁| step 1   step 2        step 3"
first, second, third = {}, {}, {}
for i, step in ipairs(h) do
  local row = errors(step, exact(1) + vec { 0, 0, 0.01 })
  first[i], second[i], third[i] = row[1][1], row[2][1], row[3][1]
  print(("%.5f    %10.4f    %10.4f    %.6f"):format(step, first[i], second[i], third[i]))
end
print(("order       %.2f          %.2f       %.2f"):format(slopes(first, h), slopes(second, h),
  slopes(third, h)))
print "The error is 0.01/h² in the first two steps; from the third on the start has no influence: O(h)."
expect(first[5]*h[5]^2):near(0.01, 1e-3)
expect(slopes(first, h)):near(-2, 0.05)
expect(slopes(second, h)):near(-2, 0.05)
expect(slopes(third, h)):near(1, 0.05)

print "\nThe program's implicit Euler on the model as it stands, direct = true"
sol = sys:integrate { start = at, from = 1, to = 1.2, dt = 0.1, inputs = { [u] = sin(t) },
  method = rk.implicit_euler, direct = true }
mine = euler(0.1, 2, exact(1))
print(("x₁ after 1 and 2 steps: %.8f %.8f, by hand %.8f %.8f"):format(sol(x[1], 1.1), sol(x[1], 1.2),
  mine[1][1], mine[2][1]))
expect(sol(x[1], 1.1)):near(mine[1][1], 1e-9)
expect(sol(x[1], 1.2)):near(mine[2][1], 1e-9)

print "\nReduced to index 1: the error has the order of the method from the first step"
low = sys:reduce "acc"
fine = low:integrate { start = low:init { inputs = { [u] = sin(t) }, from = 1 }, from = 1, to = 2, dt = 0.1,
  inputs = { [u] = sin(t) },
  method = rk.gauss(2) }
print(("x(2) = %.8f %.8f %.8f"):format(fine(x[1], 2), fine(x[2], 2), fine(x[3], 2)))
expect(fine(x, 2)):near(exact(2), 1e-6)              -- Gauss-2, dt⁴/4320 ≈ 2e-8
