return {
  title = "Planar pendulum with the constraint on its acceleration",
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1",
  statement = [[The constraint differentiated twice: index 1. Length and tangential velocity are kept only
    by the start and the accuracy.]],
  tags = "mechanics nonlinear",
  index = 1, dof = 4, structural_index = 1, structural_dof = 4, verdict = "valid",
  to = 10, dt = 0.02,
  build = function()
    local x, y, u, v, z = vars "x y u v lambda"
    local g = params "g=9.81"
    return {
      model = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - g,
        0 ~ u^2 + v^2 - z*(x^2 + y^2) - g*y,
        name = "pendulum, index 1" },
      constraints = {},
      fix = { [x] = 1, [y] = 0, [u] = 0, [v] = 0 },
      reference = { [x] = 0.275087462576115, [y] = -0.961419205099125, [u] = -4.175598100951729,
        [v] = -1.19474905456047 },
    }
  end,
}
