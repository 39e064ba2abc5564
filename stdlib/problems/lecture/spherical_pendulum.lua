return {
  title = "Spherical pendulum in Cartesian coordinates",
  source = "scripts/lecture/pendulum3d.lua, with C = (pᵀp - L²)/2",
  statement = [[A point mass on a massless rod, free in space. The energy and the angular momentum about the
    vertical are constant.]],
  tags = "lecture mechanics nonlinear",
  index = 3, dof = 4, structural_index = 3, structural_dof = 4, verdict = "valid",
  to = 2, dt = 0.02,
  -- not "minimal": the solution leaves the root of its start
  forms = { "", "acc", "ggl", "baumgarte", "ode", "project", "dummy" },
  build = function()
    local p, v, z = var("p", 3), var("v", 3), var "z"
    local m, g, L = params "m=1 g=9.81 L=1"
    return {
      model = dae { der(p) ~ v, m*der(v) ~ -m*g*vec{0, 0, 1} - z*p, 0 ~ (p.T*p - L^2)/2,
        name = "spherical pendulum" },
      constraints = { p.T*p - L^2, p.T*v },
      fix = { [p[2]] = 0, [p[3]] = 0, [v[2]] = 1, [v[3]] = 0 },
      guess = { [p[1]] = 1, [v[1]] = 0, [z] = 1 },
      reference = { [p[1]] = 0.5792511572018, [p[2]] = 0.5882467167324, [p[3]] = -0.5642994746892,
        [v[1]] = 0.4262503402345, [v[2]] = 2.159236710361, [v[3]] = 2.688412760249, [z] = 17.60733354009 },
    }
  end,
}
