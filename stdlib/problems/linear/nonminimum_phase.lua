return {
  title = "Inversion of a plant with a zero in the right half plane",
  source = [[Isidori, Nonlinear Control Systems, 3rd ed., §4.3; Byrnes & Isidori, IEEE Trans. Automat. Contr.
    36, 1991]],
  statement = [[The input that makes y = x₁ - x₂ follow sin t. One value is free, and it belongs to the zero s
    = 1: every deviation of it grows as eᵗ, in any form of the model.]],
  tags = "linear control",
  index = 2, dof = 1, structural_index = 2, structural_dof = 1, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local x1, x2, u = vars "x1 x2 u"
    local e1 = (sin(t) + cos(t))/2
    local e2 = e1 - sin(t)
    return {
      model = dae { der(x1) ~ x2, der(x2) ~ -x1 - 2*x2 + u, 0 ~ x1 - x2 - sin(t), name = "inverted plant" },
      constraints = { x1 - x2 - sin(t) },
      fix = { [x1] = 1/2 },
      exact = { [x1] = e1, [x2] = e2, [u] = diff(e2, t) + e1 + 2*e2 },
    }
  end,
}
