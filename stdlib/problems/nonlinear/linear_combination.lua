return {
  title = "A failure that a combination of equations repairs",
  source = "Tan, Nedialkov & Pryce, BIT 57, 2017 (linear combination method), with a solution chosen here",
  statement = [[Equation (3) differentiated and equation (4) have the same leading part x₁ x₄ + x₂ x₃, since
    x₃ = x₁′ and x₄ = x₂′. Their difference is a second condition on x₁ and x₂: nothing is free.]],
  tags = "nonlinear failure",
  index = 3, dof = 0, structural_index = 2, structural_dof = 1, verdict = "identically singular",
  remark = "The null vector of the system Jacobian is not constant: it contains x₁ and x₂.",
  to = 0.5, dt = 0.05,
  build = function()
    local x1, x2, x3, x4 = vars "x1 x2 x3 x4"
    local a, b = 3 + sin(t), cos(t)
    local g1, g2 = -a*b, -der(a*b) - a - b
    return {
      model = dae { 0 ~ -der(x1) + x3, 0 ~ -der(x2) + x4, 0 ~ x1*x2 + g1, 0 ~ x1*x4 + x2*x3 + x1 + x2 + g2,
        name = "linear combination" },
      constraints = { x1*x2 + g1, x1 + x2 + g2 - der(g1) },
      guess = { [x1] = 3, [x2] = 1, [x3] = 1, [x4] = 0 },
      exact = { [x1] = a, [x2] = b, [x3] = cos(t), [x4] = -sin(t) },
    }
  end,
}
