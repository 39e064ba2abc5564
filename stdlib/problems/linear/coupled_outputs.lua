return {
  title = "Two outputs whose difference hides a condition",
  source = "of the kind of Tan, Nedialkov & Pryce, BIT 57(3), 2017, §3",
  statement = [[Two integrators and two output equations that contain the algebraic unknowns in the same
    combination x₃ + x₄. Their difference is a condition on x₁ and x₂, and so is its derivative: nothing is
    free.]],
  tags = "linear failure",
  index = 3, dof = 0, structural_index = 1, structural_dof = 2, verdict = "identically singular",
  remark = [[x₃ + x₄ occurs in (3) and (4) with the same coefficients; the conversion is the combination (4) -
    (3).]],
  to = 1, dt = 0.1,
  build = function()
    local x1, x2, x3, x4 = vars "x1 x2 x3 x4"
    local b1, b2, c1, c2 = sin(t), cos(t), t^2, exp(t)
    local e2 = b1 + b2 - c1 + 2*t - exp(t)
    local e1 = c2 - c1 - e2
    return {
      model = dae { der(x1) ~ x3 + b1, der(x2) ~ x4 + b2, 0 ~ x2 + x3 + x4 + c1, 0 ~ -x1 + x3 + x4 + c2,
        name = "coupled outputs" },
      constraints = { x1 + x2 + c1 - c2, x2 - e2 },
      fix = {},
      exact = { [x1] = e1, [x2] = e2, [x3] = diff(e1, t) - b1, [x4] = diff(e2, t) - b2 },
    }
  end,
}
