return {
  title = "Four equations, up to second order, for dummy derivatives",
  source = "Mattsson & Söderlind, SIAM J. Sci. Comput. 14(3), 1993, linear example",
  statement = [[Equations (1) and (2) are differentiated twice, (3) once; five derivatives become dummies and
    two states are left.]],
  tags = "linear",
  index = 2, dof = 2, structural_index = 2, structural_dof = 2, verdict = "valid",
  to = 1, dt = 0.05,
  build = function()
    local x1, x2, x3, x4 = vars "x1 x2 x3 x4"
    local u = input("u", 4)
    local e1 = (sin(t) - cos(t) + exp(t))/2
    return {
      model = dae { x1 + x2 + u[1] ~ 0, x1 + x2 + x3 + u[2] ~ 0, x1 + der(x3) + x4 + u[3] ~ 0,
        2*der(x1, 2) + der(x2, 2) + der(x3, 2) + der(x4) + u[4] ~ 0, name = "dummy derivatives" },
      constraints = { x1 + x2 + u[1], x1 + x2 + x3 + u[2], x1.dot + x2.dot + u[1].dot,
        x1.dot + x2.dot + x3.dot + u[2].dot,
        x1 + x3.dot + x4 + u[3] },
      fix = { [x1] = 0, [x1.dot] = 1 },
      inputs = { [u[1]] = sin(t), [u[2]] = cos(t), [u[3]] = t, [u[4]] = 1 },
      exact = { [x1] = e1, [x2] = -sin(t) - e1, [x3] = sin(t) - cos(t), [x4] = -t - e1 - cos(t) - sin(t) },
    }
  end,
}
