return {
  title = "A bead on a rod that turns",
  source = "textbook example of a constraint that depends on time; Goldstein, Classical Mechanics, ch. 1",
  statement = [[The rod turns at constant ω in a horizontal plane; the bead moves outwards as r₀ cosh ωt,
    pushed sideways by z = -2 m ω r′.]],
  tags = "mechanics nonlinear",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 0.5, dt = 0.025,
  build = function()
    local q = var("q", 2)
    local m, omega = params "m=1 omega=2"
    local c, s = cos(omega*t), sin(omega*t)
    return {
      model = lagrange { q = q, T = m/2*q.dot.T*q.dot, C = { q[2]*c - q[1]*s },
        name = "bead on a turning rod" },
      constraints = { q[2]*c - q[1]*s, q[2].dot*c - q[1].dot*s - omega*(q[2]*s + q[1]*c) },
      fix = { [q[1]] = 1, [q[1].dot] = 0 },
      exact = { [q[1]] = cosh(2*t)*cos(2*t), [q[2]] = cosh(2*t)*sin(2*t) },
    }
  end,
}
