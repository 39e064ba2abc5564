return {
  title = "Planar pendulum with the constraint on its velocity",
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.1",
  statement = [[The constraint of the pendulum differentiated once: index 2. The length is no longer imposed,
    so three values are free.]],
  tags = "mechanics nonlinear",
  index = 2, dof = 3, structural_index = 2, structural_dof = 3, verdict = "valid",
  to = 10, dt = 0.02,
  -- not "minimal": the solution leaves x ≠ 0
  forms = { "", "acc", "ggl", "baumgarte", "ode", "project", "dummy" },
  build = function()
    local x, y, u, v, z = vars "x y u v lambda"
    local g = params "g=9.81"
    return {
      model = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - g, 0 ~ x*u + y*v,
        name = "pendulum, index 2" },
      constraints = { x*u + y*v },
      fix = { [x] = 1, [y] = 0, [v] = 0 },
      reference = { [x] = 0.275087462576115, [y] = -0.961419205099125, [u] = -4.175598100951729,
        [v] = -1.19474905456047 },
    }
  end,
}
