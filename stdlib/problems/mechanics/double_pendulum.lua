return {
  title = "Double pendulum in Cartesian coordinates",
  source = "textbook multibody example; reference from the angle equations",
  statement = [[Two point masses and two massless rods, let go with the first rod horizontal and the second
    hanging.]],
  tags = "mechanics nonlinear",
  index = 3, dof = 4, structural_index = 3, structural_dof = 4, verdict = "valid",
  to = 1, dt = 0.01,
  -- not "minimal": the solution leaves the root of its start
  forms = { "", "acc", "ggl", "baumgarte", "ode", "project", "dummy" },
  build = function()
    local p = var("p", 4)
    local a, b = p:slice(1, 2), p:slice(3, 4)
    local d = b - a
    local m, g, l = params "m=1 g=9.81 l=1"
    return {
      model = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*(p[2] + p[4]),
        C = { (a.T*a - l^2)/2, (d.T*d - l^2)/2 },
        name = "double pendulum" },
      constraints = { a.T*a - l^2, d.T*d - l^2, a.T*a.dot, d.T*d.dot },
      fix = { [p] = {1, 0, 1, -1}, [p.dot] = {0, 0, 0, 0} },
      reference = { [p[1]] = -0.77308876517813, [p[2]] = -0.63429784892853, [p[3]] = -1.2268703540626,
        [p[4]] = -1.5254107876683 },
    }
  end,
}
