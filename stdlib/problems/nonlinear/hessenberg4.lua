return {
  title = "A nonlinear system in Hessenberg form of size 4",
  source = "constructed for this library; the form: Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1",
  statement = [[Three states in a chain, an internal state beside them, an output that is prescribed: three
    differentiations until the control appears, and one free value.]],
  tags = "nonlinear control",
  index = 4, dof = 1, structural_index = 4, structural_dof = 1, verdict = "valid",
  to = 1, dt = 0.05,
  build = function()
    local x1, x2, x3, x4, u = vars "x1 x2 x3 x4 u"
    local y = exp(sin(t))
    local e3 = sin(y) - sin(t)
    return {
      model = dae { der(x1) ~ x1*x2, der(x2) ~ x3 - sin(x1), der(x3) ~ u*(1 + x2^2) - x1, der(x4) ~ x2 - x4,
        0 ~ x1 - y, name = "Hessenberg 4" },
      constraints = { x1 - y, x2 - cos(t), x3 - e3 },
      fix = { [x4] = 0.5 },
      exact = { [x1] = y, [x2] = cos(t), [x3] = e3, [x4] = (sin(t) + cos(t))/2,
        [u] = (diff(e3, t) + y)/(1 + cos(t)^2) },
    }
  end,
}
