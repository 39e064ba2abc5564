return {
  title = "A singular point along the solution",
  source = "constructed for this library",
  statement = [[Index 1 except at t = 1, where ∂g/∂z = t - 1 vanishes on the solution x = t, z = 1 and the
    equations leave z open.]],
  tags = "linear singular",
  index = 1, dof = 1, structural_index = 1, structural_dof = 1, verdict = "valid",
  singular = { from = 1, fix = { x = 1 }, guess = { z = 1 } },
  to = 0.9, dt = 0.1,
  build = function()
    local x, z = vars "x z"
    return {
      model = dae { der(x) ~ 1, 0 ~ (t - 1)*z - x + 1, name = "singular at t = 1" },
      constraints = {},
      fix = { [x] = 0 },
      exact = { [x] = t + 0, [z] = 1 + 0*t },
    }
  end,
}
