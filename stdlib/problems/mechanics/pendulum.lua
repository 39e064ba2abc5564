return {
  title = "Planar pendulum in Cartesian coordinates",
  source = "Pantelides, SIAM J. Sci. Stat. Comput. 9(2), 1988; Pryce, BIT 41(2), 2001",
  statement = [[The standard example of index 3: offsets c = (0, 0, 2), d = (2, 2, 0). Let go from the
    horizontal.]],
  tags = "mechanics nonlinear benchmark",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 10, dt = 0.02,
  -- not "minimal": the solution leaves the root of its start
  forms = { "", "acc", "ggl", "baumgarte", "ode", "project", "dummy" },
  build = function()
    local x, y, z = vars "x y lambda"
    local g, L = params "g=9.81 L=1"
    return {
      model = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - g, 0 ~ x^2 + y^2 - L^2, name = "planar pendulum" },
      constraints = { x^2 + y^2 - L^2, x*x.dot + y*y.dot },
      fix = { [y] = 0, [y.dot] = 0 },
      guess = { [x] = 1 },
      reference = { [x] = 0.275087462576115, [y] = -0.961419205099125, [x.dot] = -4.175598100951729,
        [y.dot] = -1.19474905456047 },
    }
  end,
}
