return {
  title = "A linear DAE on which the Σ-method fails",
  source = "after Scholz & Steinbrecher, A combined structural-algebraic approach, 2013",
  statement = [[Equations (3) and (4) determine only the sum x₃ + x₄: their difference is a hidden constraint
    on x₁ and x₂.]],
  tags = "linear failure",
  index = 3, dof = 0, structural_index = 1, structural_dof = 2, verdict = "identically singular",
  remark = "The rows (0, 0, 1, 1) of equations (3) and (4) in the system Jacobian are equal.",
  to = 1, dt = 0.1,
  build = function()
    local x1, x2, x3, x4 = vars "x1 x2 x3 x4"
    return {
      model = dae { -der(x1) + x3 ~ t, -der(x2) + x4 ~ 1, x2 + x3 + x4 ~ t^2 + cos(t) + 3*t + 1,
        -x1 + x3 + x4 ~ -sin(t) + cos(t) + 3*t + 1, name = "Scholz and Steinbrecher" },
      constraints = { x1 + x2 - t^2 - sin(t), x2 - t^2 },
      exact = { [x1] = sin(t), [x2] = t^2, [x3] = cos(t) + t, [x4] = 2*t + 1 },
    }
  end,
}
