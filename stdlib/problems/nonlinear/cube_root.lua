return {
  title = "z³ = y: a rank-deficient Jacobian at a point",
  source = [[constructed for this library; branch points: Rabier & Rheinboldt, Handbook of Numerical Analysis
    VIII, 2002]],
  statement = [[∂g/∂z = 3 z² vanishes at y = 0: there z = ∛y exists but is not differentiable, and Newton's
    method is only linear.]],
  tags = "nonlinear singular",
  index = 1, dof = 1, structural_index = 1, structural_dof = 1, verdict = "valid",
  singular = { fix = { y = 0 }, guess = { z = 0 } },
  to = 1, dt = 0.1,
  build = function()
    local y, z = vars "y z"
    return {
      model = dae { der(y) ~ 1, 0 ~ z^3 - y, name = "cube root" },
      constraints = {},
      fix = { [y] = 1 },
      guess = { [z] = 1 },
      exact = { [y] = 1 + t, [z] = (1 + t)^rational "1/3" },
    }
  end,
}
