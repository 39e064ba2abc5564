return {
  title = "Delta robot: a nacelle on three parallelogram arms",
  source = "scripts/lecture/delta_robot.lua: delta robot in Lagrange mechanics",
  statement = [[The nacelle p hangs on three long arms of length L; their upper ends sit on short arms of
    length l, turned by motors at angles α (inertia J each). With J = 0 the angles become algebraic and the
    index drops to 1: scripts/lecture/delta_robot.lua.]],
  tags = "lecture mechanics nonlinear",
  index = 3, dof = 6, structural_index = 3, structural_dof = 6, verdict = "valid",
  to = 0.2, dt = 0.01,
  build = function()
    local p, alpha = var("p", 3), var("alpha", 3)
    local q = vstack(p, alpha)
    local m, g, J, L, l, d = params "m=1 g=9.81 J=0.05 L=0.8 l=0.3 d=0.15"
    local C, constraints = {}, {}
    for k = 1, 3 do
      local gamma = 2*pi*(k - 1)/3
      local rod = p - vec { cos(gamma)*(d + l*cos(alpha[k])), sin(gamma)*(d + l*cos(alpha[k])),
        -l*sin(alpha[k]) }
      C[k] = (rod.T*rod - L^2)/2
      constraints[k], constraints[k + 3] = rod.T*rod - L^2, rod.T*der(rod)
    end
    return {
      model = lagrange { q = q, T = m/2*p.dot.T*p.dot + J/2*alpha.dot.T*alpha.dot, V = m*g*p[3], C = C,
        name = "delta robot" },
      constraints = constraints,
      fix = { [p] = {0.05, -0.02, -0.6}, [p.dot] = {0, 0, 0} },
      guess = { [alpha] = {0, 0, 0}, [alpha.dot] = {0, 0, 0} },
      reference = { [p[1]] = 0.046683999947817, [p[2]] = -0.018686847820312, [p[3]] = -0.66335884143736,
        [alpha[1]] = -0.093634675742351, [alpha[2]] = 0.1008418370529, [alpha[3]] = 0.028840019621118,
        [p[1].dot] = -0.0369916764071, [p[2].dot] = 0.014507979370473, [p[3].dot] = -0.68606378778466,
        [alpha[1].dot] = 2.5043787036915, [alpha[2].dot] = 2.0540819214502, [alpha[3].dot] = 2.219368472904 },
    }
  end,
}
