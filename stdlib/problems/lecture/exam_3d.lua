return {
  title = "Exam problem 3(d): E x′ = x with a singular E",
  source = "scripts/exam/problem3.lua, (d)",
  statement = [[Row 3 of E is the sum of rows 1 and 2, a cancellation that the pattern of zeros does not show:
    structure calls it an ODE with three free values. In truth two constraints are hidden and one mode s = 1/2
    remains.]],
  tags = "exam linear failure",
  index = 2, dof = 1, structural_index = 0, structural_dof = 3, verdict = "identically singular",
  remark = [[The structural index is wrong: E has rank 2, so the system Jacobian J = E is singular at every
    point.]],
  to = 2, dt = 0.1,
  build = function()
    local x = var("x", 3)
    return {
      model = dae.linear { E = { {1, 1, 0}, {0, 0, 1}, {1, 1, 1} }, A = eye(3), x = x, name = "exam 3(d)" },
      constraints = { x[1] + x[2] - x[3], x[1] - x[2] },
      fix = { [x[1]] = 1 },
      exact = { [x[1]] = exp(t/2), [x[2]] = exp(t/2), [x[3]] = 2*exp(t/2) },
    }
  end,
}
