return {
  title = "An algebraic equation with two roots",
  source = "constructed for this library",
  statement = [[y = ±√(1 - x²): the guess chooses the branch. Along x = 1/cosh(t + 1), y = tanh(t + 1) the
    model has index 1; at y = 0 the branches meet and it is singular.]],
  tags = "nonlinear singular",
  index = 1, dof = 1, structural_index = 1, structural_dof = 1, verdict = "valid",
  to = 1, dt = 0.05,
  build = function()
    local x, y = vars "x y"
    return {
      model = dae { der(x) ~ -x*y, 0 ~ y^2 + x^2 - 1, name = "two branches" },
      constraints = {},
      fix = { [x] = evaluate(1/cosh(t), { t = 1 }) },
      guess = { [y] = 1 },
      exact = { [x] = 1/cosh(t + 1), [y] = tanh(t + 1) },
    }
  end,
}
