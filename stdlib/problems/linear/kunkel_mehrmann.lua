return {
  title = "A pencil singular at every t, and yet one solution",
  source = "Kunkel & Mehrmann, Differential-Algebraic Equations, EMS 2006, Example 3.2",
  statement = [[det(s E(t) - A(t)) = 0 for every s and t, but the solution is unique: x₂ = f₂ - f₁′. Freezing
    t says nothing about a time-varying system.]],
  tags = "linear failure",
  index = 2, dof = 0, structural_index = 1, structural_dof = 1, verdict = "identically singular",
  remark = "Equation (1) differentiated and equation (2) have the same leading part x₁′ - t x₂′.",
  to = 1, dt = 0.1,
  build = function()
    local x1, x2 = vars "x1 x2"
    return {
      model = dae { 0 ~ -x1 + t*x2 + cos(t), der(x1) - t*der(x2) ~ 0,
        name = "singular pencil, unique solution" },
      constraints = { x1 - t*x2 - cos(t), x2 - sin(t) },
      exact = { [x1] = t*sin(t) + cos(t), [x2] = sin(t) },
    }
  end,
}
