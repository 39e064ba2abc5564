--- # Exam problem 1: Lagrange modelling
--- Two masses m, the first on a sphere of radius R, joined by a rigid link of length L. Text and printed
--- solution: the course exam; what is misprinted there is corrected here and said in comments.
--
--   ./dev run scripts/exam/problem1.lua              the numbers, and the figures in the terminal with: …
--   problem1.lua show
--
-- Everything below is typed as one would at the prompt.

q       = var("q", 6)                              -- generalised coordinates, z-axis up
p1, p2  = q:slice(1, 3), q:slice(4, 6)             -- the two masses
m, g, R, L = params "m=1 g=9.81 R=1 L=0.5"

print "1(a)  The model as a semi-explicit index-3 DAE"
chain = lagrange {
  q = q,
  T = m/2 * q.dot.T * q.dot,
  -- exam (2) with a = (0,0,1,0,0,1): the print counts m twice
  V = m*g*(p1[3] + p2[3]),
  C = { (p1.T*p1 - R^2)/2, (norm(p2 - p1)^2 - L^2)/2 },
}
print("T =", chain.T)
print("V =", chain.V)
for i = 1, 2 do print("C" .. i .. " =", chain.C[i]) end
print("W ="); print(chain.M)
print("∂C/∂q ="); print(chain.dCdq)                -- exam (7), transposed
print "The derivation:"
print(chain:trace())
print(chain)
print("index " .. chain:index() .. ": " .. #chain.differential .. " differential + " .. #chain.algebraic
  .. " algebraic variables")

print "\n1(b)  An equivalent fully implicit index-1 DAE"
low = chain:reduce "acc"
print(low:trace())
print(low)
print("In matrix form (exam (10b) with its off-diagonal blocks in their places):")
print(chain.matrix_form)
print("rank of the matrix at a generic point: " .. rank(chain.matrix_form.A) .. " of "
  .. chain.matrix_form.A.rows)
print("kind: " .. low.kind .. ", index " .. low:index())
print("consistency conditions:"); print(chain:constraints())

print "\nNumbers at a consistent start"
at = chain:init { fix = {
  [p1] = {0.6, 0, -0.8}, [p2] = {0.6, 0, -1.3},
  [p1.dot] = {0.8, 0.5, 0.6}, [p2.dot] = {1.1, 0.3, 0.6},
} }
print(at:ledger())
a1, a2, z = at(p1.ddot), at(p2.ddot), at(chain.multipliers)
expect(a1):near({-8.119411764706, 0, -4.527058823529}, 1e-11)
expect(a2):near({0, 0, -4.267058823529}, 1e-11)
expect(z):near({13.532352941176, 11.085882352941}, 1e-11)

print "\n1(c)  Why does the simulated mass leave the sphere?"
C1, C2 = chain.C[1], chain.C[2]
fast = { to = 10, method = rk.gauss(2), dt = 0.01 }

print "A consistent start, a good method: nothing drifts"
good = low:integrate { start = at, to = fast.to, method = fast.method, dt = fast.dt }
print(good:drift())

print "\nThe same start, a poor method with a large step: numerical drift"
poor = low:integrate { start = at, to = 10, method = rk.heun, dt = 0.02 }
print(poor:drift())

print "\nA start on the sphere with C′(0) ≠ 0: the velocity of mass 1 has a radial part"
wrong = low:init { consistent = false, fix = {
  [p1] = {0.6, 0, -0.8}, [p2] = {0.6, 0, -1.3},
  [p1.dot] = {0.86, 0.5, 0.52}, [p2.dot] = {1.1, 0.3, 0.52},
} }
off = low:integrate { start = wrong, to = fast.to, method = fast.method, dt = fast.dt }
print(off:drift())

-- C″ = 0 is all that the index-1 model imposes, so C(t) = C(0) + t C′(0): the slope must be C′(0).
slope = (off(C1, 10) - off(C1, 0)) / 10
print(("slope of C1 over 10 s: %.6f,  C1′(0): %.6f"):format(slope, wrong(der(C1))))
expect(slope):near(wrong(der(C1)), 1e-6)

figure2 = plot3(off, p1, { title = "Mass 1 leaves the sphere: C1′(0) = 0.1", surfaces = { sphere(1) } })
figure1 = plot3(good, p1, { title = "A consistent start stays on it", surfaces = { sphere(1) } })
lines   = plot(off, { C1, C2 }, { title = "C(t) from an inconsistent start", labels = { "C1", "C2" } })
level   = plot(good, { C1, C2 }, { title = "C(t) from a consistent start", labels = { "C1", "C2" } })
lines:show()
if arg and arg[1] == "show" then
  figure1:show() figure2:show() level:show()
elseif arg and arg[1] == "save" then
  figure1:save "sphere-consistent.svg"
  figure2:save "sphere-inconsistent.svg"
  lines:save "drift.svg"
  level:save "no-drift.svg"
end

print [[

Verdict. Two things can make the mass leave the surface.
 1. Constraint drift: the index-1 model imposes C″ = 0 only, numerical errors are integrated twice, and C
    grows slowly. It depends on the method and the step: see the two tables above.
 2. An inconsistent start: C′(0) ≠ 0. Then C(t) = C(0) + t C′(0), a straight line, whatever the accuracy.
 Over only 10 s, starting on the sphere and leaving it at once at constant rate, the second is at play.]]
