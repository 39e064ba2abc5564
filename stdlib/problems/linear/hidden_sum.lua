return {
  title = "A constraint that only the sum of two equations shows",
  source = [[constructed for this library; the remedy is a linear combination as in Tan, Nedialkov & Pryce,
    BIT 57, 2017]],
  statement = [[The sum of both equations is x = t + sin t; nothing is free. Structure sees two equations of
    order two, as if x and x′ could be chosen.]],
  tags = "linear failure",
  index = 3, dof = 0, structural_index = 1, structural_dof = 2, verdict = "identically singular",
  remark = [[The leading coefficients are (-1, -1) and (1, 1) in x″ and y: the system Jacobian has determinant
    0.]],
  to = 1, dt = 0.1,
  build = function()
    local x, y = vars "x y"
    return {
      model = dae { -der(x, 2) - y ~ sin(t), der(x, 2) + x + y ~ t, name = "hidden sum" },
      constraints = { x - t - sin(t), x.dot - 1 - cos(t) },
      exact = { [x] = t + sin(t), [y] = 0*t },
    }
  end,
}
