return {
  title = "An implicit ODE with an impasse: x′² + x² = 1",
  source = [[constructed for this library; impasse points: Rabier & Rheinboldt, Handbook of Numerical Analysis
    VIII, 2002]],
  statement = [[Index 0 where ∂F/∂x′ = 2 x′ ≠ 0: x = sin t until x′ = 0 at x = 1, where the constant solution
    x = 1 branches off.]],
  tags = "nonlinear singular",
  index = 0, dof = 1, structural_index = 0, structural_dof = 1, verdict = "valid",
  to = 1, dt = 0.05,
  build = function()
    local x = var "x"
    return {
      model = dae { der(x)^2 + x^2 ~ 1, name = "implicit circle" },
      constraints = {},
      fix = { [x] = 0 },
      guess = { [x.dot] = 1 },
      exact = { [x] = sin(t) },
    }
  end,
}
