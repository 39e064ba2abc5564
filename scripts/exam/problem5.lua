--- # Exam problem 5: simulation with implicit Runge–Kutta methods
--- Corrections to the print: the stopping test of the algorithm is ‖r(K, z, x_k)‖, z needs a start and is
--- returned too; what is printed as the solution of 5(d) answers 5(e). Order 2s of Gauss methods holds for
--- ODEs at the mesh points (73).
--
--   pendula scripts/exam/problem5.lua              the numbers; with `show` also the pictures: … problem5.lua
--   show
local show = arg and arg[1] == "show"

print "5(a)  An IRK scheme for F(x′, x, z) = 0, written out by hand"
x, z = var("x", 2), var "z"
-- implicit in x₂′, one algebraic variable
F = vec { x.dot[1] - x[2], (1 + z)*x.dot[2] + x[1], z - x[1]*x[2]/4 - z^3/10 }
print(F)

-- Algorithm (55). w = (K₁, z₁, …, K_s, z_s); r(w, x_k) stacks F(Kᵢ, x_k + Δt Σⱼ aᵢⱼ Kⱼ, zᵢ); ∂r/∂w is exact.
function irk(F, x, z, tab, x0, z0, dt, steps, tol)
  local n, s = #x, tab.stages
  local xk, K, zs, blocks = var("xk", n), {}, {}, {}
  for i = 1, s do K[i], zs[i] = var("K" .. i .. "_", n), var("z" .. i .. "_") end
  local w = {}
  for i = 1, s do
    local stage = xk
    for j = 1, s do stage = stage + dt*tab.A(i, j)*K[j] end
    blocks[i] = subs(F, { [x.dot] = K[i], [x] = stage, [z] = zs[i] })
    w[i] = vstack(K[i], vec { zs[i] })
  end
  local unknowns, r = vstack(table.unpack(w)), vstack(table.unpack(blocks))
  local r_of, M_of = fn({ unknowns, xk }, r), fn({ unknowns, xk }, jacobian(r, unknowns))
  local now, guess, newton_steps = vec(x0), {}, 0
  for i = 1, s do guess[i] = vec { 0, 0, z0 } end           -- K = 0 and the start of z
  local W = evaluate(vstack(table.unpack(guess)))
  local N = unknowns.rows
  for k = 1, steps do
    local residual = r_of(W, now)
    while norm(residual) > tol do
      local M = M_of(W, now)                                 -- N × N, a point's matrix
      W = W - solve(M, residual)                             -- the Newton step (55)
      residual = r_of(W, now)
      newton_steps = newton_steps + 1
    end
    local sum = now
    for i = 1, s do sum = sum + dt*tab.b[i]*W:slice((i - 1)*(n + 1) + 1, (i - 1)*(n + 1) + n) end
    now = evaluate(sum)                                      -- x_{k+1} = x_k + Δt Σ bᵢ Kᵢ
  end
  return now, W[N], newton_steps, r, unknowns
end

tab = rk.gauss(2)
by_hand, z_hand, count, r, w = irk(F, x, z, tab, {1, 0.5}, 0.1, 0.1, 20, 1e-13)
print("by hand:   x(2) = " .. ("%.10f, %.10f"):format(by_hand[1], by_hand[2])
  .. ("   %d Newton steps for 20 steps"):format(count))
model = dae.implicit { x = x, z = vec { z }, F = F }
at = model:init { fix = { [x] = {1, 0.5} }, guess = { z = 0.1 } }
print "The algorithm, with its equations, its Jacobian and the Newton step:"
print(explain_step(model, tab))
built_in = model:integrate { start = at, to = 2, method = tab, dt = 0.1 }
print("built in:  x(2) = " .. ("%.10f, %.10f"):format(built_in:final(x[1]), built_in:final(x[2])))
expect(by_hand):near(built_in:final(x), 1e-13)               -- the same scheme: equal to rounding
print("equal to rounding: " .. tostring(norm(by_hand - built_in:final(x)) < 1e-13))

print "\n5(b)  The highest order with s stages is 2s: Gauss–Legendre nodes"
print [[
Only one choice reaches it: the nodes are the zeros of the shifted Legendre polynomial Pₛ, and A and b are
those of collocation, aᵢⱼ = ∫ ℓⱼ over [0, cᵢ] and bⱼ = ∫ ℓⱼ over [0, 1].]]
for s = 1, 3 do
  local gauss = rk.gauss(s)
  local nodes = {}
  for i = 1, s do nodes[i] = ("%.10f"):format(evaluate(gauss.c[i])) end
  print(("  s = %d  order %d  nodes %s"):format(s, gauss:order(), table.concat(nodes, ", ")))
end
print("  any other nodes give less: equidistant 0, 1/2, 1 has order "
  .. rk.collocation { 0, "1/2", 1 }:order()
  .. ", 1/4, 1/2, 3/4 has order " .. rk.collocation { "1/4", "1/2", "3/4" }:order())
v = var "v"
decay = dae { der(v) ~ -2*v }
table5b = converge(decay, { start = { v = 1 }, to = 2, methods = { rk.gauss(1), rk.gauss(2), rk.gauss(3) },
                            dt = { 0.2, 0.1, 0.05 }, exact = exp(-2*t) })
print(table5b)
for s = 1, 3 do expect(table5b.slopes[s]):near(2*s, 0.05) end
if show then table5b:plot():show() end

print "\n5(c)  Why not many stages? One factorisation costs (n s)³"
print [[
Every Newton step solves a system of s (n_x + n_z) equations, O(n³ s³) operations, in each of N = t_f/Δt
steps. For an error O(Δt²ˢ) that is O(n³ s³/Δt) work: more stages pay only where they allow steps so much
longer that s³ is outweighed. Otherwise a smaller Δt is cheaper.]]
p, q = vars "p q"
oscillator = dae { der(p) ~ q, der(q) ~ 3*(1 - p^2)*q - p }  -- Van der Pol, n = 2
run = { start = { p = 2, q = 0 }, to = 5 }
reference = oscillator:integrate { start = run.start, to = run.to, method = rk.gauss(6), dt = 1/256 }
print "  stages  order   dt        error     steps   × (n s)³, one factorisation each"
for _, tolerance in ipairs { 1e-3, 1e-6, 1e-9 } do
  for s = 1, 4 do
    local dt, sol, distance = 1/4, nil, nil
    repeat
      dt = dt/2
      sol = oscillator:integrate { start = run.start, to = run.to, method = rk.gauss(s), dt = dt }
      distance = norm(sol:final() - reference:final())
    until distance <= tolerance or dt < 1/8192
    local steps = math.tointeger(run.to/dt)
    if distance <= tolerance then
      print(("  %d       %d       1/%-6d  %.1e   %5d   %7d"):format(s, 2*s, math.tointeger(1/dt), distance,
        steps, steps*(2*s)^3 // 1))
    else
      print(("  %d       %d       dt < 1/8192 does not reach it"):format(s, 2*s))
    end
  end
  if tolerance > 1e-9 then print "" end
end
print "  Blocks: error below 1e-3, 1e-6, 1e-9. The cheapest is s = 1, 2, 3: more stages pay off for high accuracy only, and s = 4 never does here."

print "\n5(d)  Why not explicit methods of high order?"
print "Stages grow faster than the order (Table 1 of the exam), here with the methods of the library:"
print "  order  stages (least possible)  method"
least = { 1, 2, 3, 4, 6, 7, 9, 11 }
for _, row in ipairs { { 1, rk.euler }, { 2, rk.midpoint }, { 3, rk.bogacki_shampine }, { 4, rk.rk4 },
  { 5, rk.dopri5 }, { 6, rk.butcher6 }, { 7, rk.verner76 }, { 8, rk.dop853 } } do
  local order, method = row[1], row[2]
  expect(method:order()):equals(order)
  print(("  %d      %2d (%d)                  %s"):format(order, method.stages, least[order], method.name))
end
print "and the stability interval hardly grows: |R(z)| ≤ 1 on the real axis down to"
z_ = var "zz"
for order, tab in ipairs { rk.euler, rk.midpoint, tableau { A = { {}, {"1/2"}, {-1, 2} },
  b = { "1/6", "2/3", "1/6" } }, rk.rk4 } do
  local limit = tab:stability().real
  print(("  order %d   z = %.10f   per stage %.4f"):format(order, limit, limit/tab.stages))
end
print "A stiff problem, x′ = -1000 x to t = 1: the step is set by stability, not by accuracy"
stiff = dae { der(v) ~ -1000*v }
for _, dt in ipairs { 1/300, 1/400 } do
  local sol = stiff:integrate { start = { v = 1 }, to = 1, method = rk.rk4, dt = dt }
  print(("  rk4, dt = 1/%d: |x(1)| %s"):format(math.floor(1/dt + 0.5),
    math.abs(sol:final(v)) < 1e-6 and "decays" or "grows beyond all bounds"))
end
sol = stiff:integrate { start = { v = 1 }, to = 1, method = rk.radau(2), dt = 0.1 }
print(("  radau(2), dt = 1/10: |x(1)| %s"):format(math.abs(sol:final(v)) < 1e-6 and "decays" or "grows"))

print "\n5(e)  The IRK equations for x′ = f(x, z, u), 0 = g(x, z, u), and their Jacobian"
f, g = func "f", func "g"
X, K1, K2, Z1, Z2, U1, U2, h = var "xk", var "K1", var "K2", var "z1", var "z2", var "u1", var "u2", param "h"
a = { { param "a11", param "a12" }, { param "a21", param "a22" } }
X1, X2 = X + h*(a[1][1]*K1 + a[1][2]*K2), X + h*(a[2][1]*K1 + a[2][2]*K2)
S1, S2 = var "X1", var "X2"                        -- the stages by name; the chain rule says what is in them
re = vec { K1 - f(S1, Z1, U1), g(S1, Z1, U1), K2 - f(S2, Z2, U2), g(S2, Z2, U2) }
we = vec { K1, Z1, K2, Z2 }
print "w = (K₁, z₁, K₂, z₂), r(w) ="
for i = 1, #re do print("  " .. tostring(re[i])) end
print("with  X₁ =", X1); print("      X₂ =", X2)
print "∂r/∂w ="
print(jacobian(re, we) + jacobian(re, vec { S1, S2 })*jacobian(vec { X1, X2 }, we))
semi = dae.semi_explicit { x = { var "x1" }, z = { var "z1" }, u = { input "u" },
  f = f(var "x1", var "z1", input "u"), g = g(var "x1", var "z1", input "u") }
print(explain_step(semi, rk.gauss(2)))
print "The block pattern for n = 3 states, m = 2 algebraic variables and s = 3 stages, and the one of 5(a):"
xs, zs = var("xs", 3), var("zs", 2)
fs, gs = func("fs", 3), func("gs", 2)
s, rows, ws = 3, {}, {}
for i = 1, s do ws[i] = vstack(var("k" .. i .. "_", 3), var("zz" .. i .. "_", 2)) end
for i = 1, s do
  local stage = xs
  for j = 1, s do stage = stage + param("a" .. i .. j .. "_")*ws[j]:slice(1, 3) end
  rows[i] = vstack(ws[i]:slice(1, 3) - fs(stage, ws[i]:slice(4, 5)), gs(stage, ws[i]:slice(4, 5)))
end
pattern = spy(jacobian(vstack(table.unpack(rows)), vstack(table.unpack(ws))))
pattern:show()
spy(jacobian(r, w)):show()
