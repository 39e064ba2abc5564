-- The reference problems: fifty models from the literature whose index, free values, constraints and solution
-- are known.
--
--   ./dev run scripts/problems.lua

print(problems.list())

print "\nOne of them, with everything that is known about it"
print(problems.reissig)

print "\nWhere structure alone misleads, and what the program finds"
print "(index, free values)  structure                      truth  found"
for _, p in ipairs(problems.list "failure") do
  if p.index then
    local sys = p()
    local agrees = sys:index() == p.index and sys:dof() == p.dof
    print(("%-20s  %d, %d   %-22s  %d, %d   %s"):format(p.name, p.structural_index, p.structural_dof,
      p.verdict,
      p.index, p.dof, agrees and "the same" or "something else"))
    expect(agrees):is_true()
  end
end

print "\nA model, a start, a solution, its error"
-- problems.pendulum{ g = 1.62 } would be one on the moon
pendulum = problems.pendulum()
at = problems.pendulum:start()
sol = pendulum:reduce():integrate { start = at, to = 10, method = rk.gauss(4), dt = 0.02 }
x, y = vars "x y"
print(("x(10) = %.9f, y(10) = %.9f; known to be %.9f, %.9f"):format(sol(x, 10), sol(y, 10),
  problems.pendulum:solution()[x], problems.pendulum:solution()[y]))
expect(problems.pendulum:error(sol) < 1e-8):is_true()

print "\nSix problems in the form that reduce() chooses, by gauss(3) with the step size of the library"
for _, p in ipairs { problems.exam_3d, problems.cstr, problems.jay_index3, problems.spring_servo,
  problems.squeezer, problems.akzo } do
  local low = p():reduce()
  local sol = low:integrate { start = p:start(), to = p.to, inputs = p.inputs, method = rk.gauss(3),
    dt = p.dt }
  local digits = -math.log(p:error(sol) + 1e-16, 10)
  print(("%-14s index %d  %-10s correct digits at t = %g: %s"):format(p.name, p.index,
    low.form == "" and "as it is" or low.form, p.to,
    digits >= 8 and "8 or more" or ("%.0f"):format(digits)))
  expect(digits >= 8):is_true()
end
