return {
  title = "Jay's index-2 test problem",
  source = "Jay, BIT 33, 1993, with y₁′ = y₁ y₂ z",
  statement = [[Hessenberg form of size two with a known solution, to measure the order of methods on
    differential and algebraic components.]],
  tags = "nonlinear",
  index = 2, dof = 1, structural_index = 2, structural_dof = 1, verdict = "valid",
  to = 0.5, dt = 0.025,
  build = function()
    local y1, y2, z = vars "y1 y2 z"
    return {
      model = dae { der(y1) ~ y1*y2*z, der(y2) ~ y1^2*y2^2 - 3*y2^2*z, 0 ~ y1^2*y2 - 1,
        name = "Jay, index 2" },
      constraints = { y1^2*y2 - 1 },
      fix = { [y1] = 1 },
      exact = { [y1] = exp(t), [y2] = exp(-2*t), [z] = exp(2*t) },
    }
  end,
}
