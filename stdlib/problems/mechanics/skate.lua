return {
  title = "A skate on an inclined plane",
  source = "nonholonomic textbook example; Neimark & Fufaev, Dynamics of Nonholonomic Systems, 1972",
  statement = [[The velocity points along the blade: a constraint on velocities that no constraint on
    positions replaces. Index 2, and all three positions are free. It does not slide down for ever but returns
    to its height.]],
  tags = "mechanics nonlinear",
  index = 2, dof = 5, structural_index = 2, structural_dof = 5, verdict = "valid",
  to = 1, dt = 0.02,
  build = function()
    local x, y, phi, z = vars "x y phi z"
    local a = params "a=2"                    -- g sin of the slope, along x
    return {
      model = dae { der(x, 2) ~ a + z*sin(phi), der(y, 2) ~ -z*cos(phi), der(phi, 2) ~ 0,
        0 ~ x.dot*sin(phi) - y.dot*cos(phi),
        name = "skate" },
      constraints = { x.dot*sin(phi) - y.dot*cos(phi) },
      fix = { [x] = 0, [y] = 0, [phi] = 0, [x.dot] = 0, [phi.dot] = 3/2 },
      exact = { [x] = 4*sin(3*t/2)^2/9, [y] = 4*(3*t/2 - sin(3*t)/2)/9, [phi] = 3*t/2, [z] = -4*sin(3*t/2) },
    }
  end,
}
