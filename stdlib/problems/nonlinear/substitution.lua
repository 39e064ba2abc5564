return {
  title = "A failure that an expression substitution repairs",
  source = [[Tan, Nedialkov & Pryce, BIT 57, 2017 (expression substitution method), with a solution chosen
    here]],
  statement = [[Equation (2) differentiated gives x₁′ + x₂ x₂″, which is all that equation (1) contains of
    these derivatives.]],
  tags = "nonlinear failure",
  index = 2, dof = 1, structural_index = 1, structural_dof = 2, verdict = "identically singular",
  remark = "With x₁′ + x₂ x₂″ replaced by -x₂′² - 2 x₂ x₂′ - h₂′ the first equation is free of it.",
  to = 0.5, dt = 0.025,
  build = function()
    local x1, x2 = vars "x1 x2"
    local a, b = cos(t), 2 + sin(t)
    local h1 = -a - exp(-der(a) - b*der(b, 2))
    local h2 = -a - b*der(b) - b^2
    return {
      model = dae { 0 ~ x1 + exp(-der(x1) - x2*der(x2, 2)) + h1, 0 ~ x1 + x2*der(x2) + x2^2 + h2,
        name = "substitution" },
      constraints = { x1 + x2*x2.dot + x2^2 + h2, x1 + exp(x2.dot^2 + 2*x2*x2.dot + der(h2)) + h1 },
      fix = { [x2] = 2 },
      guess = { [x1] = 1, [x2.dot] = 1, [x1.dot] = 0, [der(x2, 2)] = 0 },
      exact = { [x1] = a, [x2] = b },
    }
  end,
}
