--- # Exam problem 3: differential-algebraic and implicit differential equations
--- Text and printed solution: the course exam; what is misprinted there is corrected here and said in
--- comments.
--
--   ./dev run scripts/exam/problem3.lua
--
-- Everything below is typed as one would at the prompt. Letters (a) to (c), (e) and (f) are about models
-- whose functions are not given: func makes such functions, and what is said holds for all of them.

print "3(a)  F(x′, x, z, u) = 0: how many arguments x′, how many rows?"
x, z, u = var("x", 2), var "z", input "u"          -- n_x = 2, n_z = 1, n_u = 1
F = func("F", 3)
implicit = dae.implicit { x = x, z = z, u = u, F = F(x.dot, x, z, u) }
print(implicit)
print [[
x′ has as many entries as x, so n = n_x. For given x and u the equations F = 0 have to determine x′ and z,
n_x + n_z unknowns, so F has m = n_x + n_z rows: the implicit function theorem asks for a matrix ∂F/∂(x′, z)
that is square and regular.]]
J = jacobian(F(x.dot, x, z, u), vstack(x.dot, z))
print("∂F/∂(x′, z) ="); print(J)
print(("n = n_x = %d,  m = n_x + n_z = %d;  the matrix is %d × %d"):format(#x, #x + 1, J.rows, J.cols))
expect(J.rows):equals(J.cols)
for _, m in ipairs { 2, 4 } do
  local wrong = dae.implicit { x = x, z = z, u = u, F = func("F", m)(x.dot, x, z, u) }
  print(("with m = %d: %s"):format(m, tostring(wrong):match "; ([^\n]*)"))
  expect(function() return wrong:index() end):fails(m .. " equations for 3 unknowns")
end

print "\n3(b)  The semi-explicit DAE in fully implicit form"
f, g = func("f", 2), func "g"
semi = dae.semi_explicit { x = x, z = z, u = u, f = f(x, z, u), g = g(x, z, u) }
print(semi)
print(semi:implicit())                             -- exam (41) with the other sign
print(semi:implicit():trace())
expect(#semi:implicit().differential):equals(2)
expect(#semi:implicit().algebraic):equals(1)

print "\n3(c)  The fully implicit DAE in semi-explicit form: new algebraic variables δ = x′"
opened = implicit:semi_explicit()                  -- exam (42)
print(opened)
print(("differential %d (as before), algebraic %d = n_x + n_z"):format(#opened.differential,
  #opened.algebraic))
expect(opened.kind):equals "semi-explicit"
expect(#opened.differential):equals(2)
expect(#opened.algebraic):equals(3)

print "\n3(d)  E x′ = x"
E = mat { {1, 1, 0}, {0, 0, 1}, {1, 1, 1} }
trap = dae.linear { E = E, A = eye(3), name = "(38)" }
print(trap)
print("1. rank E = " .. rank(E)
  .. " of 3: a DAE, no implicit ODE. Its structure alone is mistaken for one with three free values:")
print(trap:structure())
expect(rank(E)):equals(2)
expect(trap:structure().structural_index):equals(0)
expect(trap:structure().structural_dof):equals(3)
expect(trap:structure().valid):equals(false)

print "2. Combine and differentiate until E is regular (exam (43) to (48)):"
pencil = trap:pencil()
print(pencil:shuffle())
expect(pencil:shuffle()):matches "%(c%) %- %(a%) %- %(b%):"
expect(pencil:shuffle()):matches "%(d%) %- %(a%) %+ %(b%):"
expect(pencil:shuffle()):matches "%(e%) %+ %(a%):"
print "Index, free values, mode, consistent set, by the pencil sE - A:"
print(pencil)
expect(trap:index()):equals(2)
expect(trap:dof()):equals(1)
expect(tostring(pencil.det)):equals "2 s - 1"
expect(tostring(pencil.modes[1].re)):equals "1/2"
expect(tostring(pencil.basis)):equals "(1, 1, 2)"
print("constraints on every start:"); print(trap:constraints())
expect(#trap:constraints()):equals(2)
alpha = param "alpha"
print("x(t) =", pencil:solution { x1 = alpha })
expect(tostring(pencil:solution { x1 = alpha })):equals "(α exp(t/2), α exp(t/2), 2 α exp(t/2))"
print "A start that is not in the consistent set is refused:"
print((select(2, pcall(function() pencil:solution { 1, 2, 3 } end)):gsub("^[^ ]* ", "")))
-- By numbers: the semi-explicit form, integrated, against e^{t/2}.
at = trap:init { fix = { x1 = 1 } }
sol = trap:reduce("acc"):integrate { start = at, to = 2, method = rk.gauss(3), dt = 0.1 }
print(("x(2) from α = 1: %.8f %.8f %.8f"):format(sol(var "x1", 2), sol(var "x2", 2), sol(var "x3", 2)))
expect(sol(vec { var "x1", var "x2", var "x3" }, 2)):near({ math.exp(1), math.exp(1), 2*math.exp(1) }, 1e-9)

print "\n3(e)  x′ = A x + b z, 0 = g(x)"
x = var("x", 2)
a11, a12, a21, a22 = params "a11 a12 a21 a22"
b1, b2 = params "b1 b2"
A, b, g = mat { {a11, a12}, {a21, a22} }, vec { b1, b2 }, func "g"
-- z is a scalar and F must have n_x + 1 rows, so g: ℝⁿ → ℝᵐ has m = 1 (the print gives g a second argument
-- that it has not).
general = dae.semi_explicit { x = x, z = z, f = A*x + b*z, g = g(x), name = "(39)" }
print(general)
print "m = 1: the unknowns x′ and z are n_x + 1, and (39a) gives n_x equations, so g has one row."
low = general:reduce "acc"
print "Index reduction:"
print(low:trace())
gx = jacobian(g(x), x)
print("Substituting (1):  0 =", (gx*(A*x + b*z)))    -- exam (49b)
print("solvable for z where  ∂g/∂x b =", gx*b, "≠ 0: a scalar, so full rank means different from 0")
print("z =", -(gx*A*x)/(gx*b))
print "consistency:"; print(general:constraints())
print "z(0) is not free either: it follows from the differentiated equation. Index 3 or more needs ∂g/∂x b = 0 identically near the solution."
expect(general:index()):equals(2)
expect(general:dof()):equals(1)
expect(#general:constraints()):equals(1)
expect(low:index()):equals(1)

print "For A = [0 1; -1 0], b = (0, 1), g = x1 + 2 x2 - 3 at x = (1, 1):"
line = x[1] + 2*x[2] - 3
numbers = dae.semi_explicit { x = x, z = z, f = mat { {0, 1}, {-1, 0} }*x + vec { 0, 1 }*z, g = line }
print(numbers)
at = numbers:init { fix = { [x[1]] = 1 } }
print(at:ledger())
print("∂g/∂x b =", jacobian(line, x)*vec { 0, 1 })
expect(at(x)):near({1, 1}, 1e-10)
expect(at(z)):near(0.5, 1e-10)
expect(at(x.dot)):near({1, -0.5}, 1e-10)
expect(numbers:index()):equals(2)
print "and where ∂g/∂x b = 0, b = (0, 1), g = x1 - 3, the index is larger:"
more = dae.semi_explicit { x = x, z = z, f = mat { {0, 1}, {-1, 0} }*x + vec { 0, 1 }*z, g = x[1] - 3 }
print(("index %d, %d free initial values; constraints"):format(more:index(),
  more:dof())); print(more:constraints())
expect(more:index()):equals(3)
expect(more:dof()):equals(0)

print "\n3(f)  x′ = f(x, z, u), 0 = g(x): at least index 2"
f, g = func("f", 2), func "g"
last = dae.semi_explicit { x = x, z = z, u = u, f = f(x, z, u), g = g(x), name = "(40)" }
print(last)
gz = diff(g(x), z)
print("∂g/∂z =", gz, ": rank " .. rank(mat { { gz } }) .. ", and index 1 requires full rank")
expect(gz):equals(0)
expect(last:index()):equals(2)                     -- for every f and g with ∂g/∂x ∂f/∂z ≠ 0
expect(last:index() >= 2):is_true()
print("the Jacobian that index 1 requires, ∂(f - x′, g)/∂(x′, z):")
print(jacobian(vstack(f(x, z, u) - x.dot, g(x)), vstack(x.dot, z)))
