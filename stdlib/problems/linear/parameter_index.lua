return {
  title = "An index that depends on a parameter",
  source = "constructed for this library",
  statement = [[With ε ≠ 0 an ODE in disguise, index 1; with ε = 0 the model x = sin t, z = x′ of index 2.
    The structural index, which ignores values, is 1.]],
  tags = "linear singular",
  index = 1, dof = 1, structural_index = 1, structural_dof = 1, verdict = "valid",
  variants = { { params = { epsilon = 0 }, index = 2, dof = 0 } },
  to = 2, dt = 0.1,
  build = function()
    local x, z = vars "x z"
    local epsilon = param("epsilon", 1)
    local e = (sin(t) - cos(t) + exp(-t))/2
    return {
      model = dae { der(x) ~ z, 0 ~ x + epsilon*z - sin(t), name = "index by parameter" },
      constraints = {},
      fix = { [x] = 0 },
      exact = { [x] = e, [z] = der(e) },
    }
  end,
}
