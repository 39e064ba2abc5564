return {
  title = "Van der Pol's equation in its singular limit",
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §VI.1",
  statement = [[ε z′ = (1 - y²) z - y with ε = 0. On each branch ln y - y²/2 = t + const; the solution ends at
    y = ±1, where ∂g/∂z = 0.]],
  tags = "nonlinear singular",
  index = 1, dof = 1, structural_index = 1, structural_dof = 1, verdict = "valid",
  to = 0.5, dt = 0.025,
  build = function()
    local y, z = vars "y z"
    return {
      model = dae { der(y) ~ z, 0 ~ (1 - y^2)*z - y, name = "van der Pol, ε = 0" },
      constraints = {},
      fix = { [y] = 2 },
      -- root of ln y - y²/2 = ln 2 - 2 + 1/2
      reference = { [y] = 1.5967683944573745, [z] = -1.0303929933625986 },
    }
  end,
}
