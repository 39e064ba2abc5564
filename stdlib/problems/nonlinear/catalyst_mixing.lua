return {
  title = "Catalyst mixing, on the singular arc",
  source = [[Jackson, J. Optim. Theory Appl. 2, 1968; COPS benchmark set, problem 14 (Dolan, Moré & Munson,
    2004)]],
  statement = [[Two catalysts in the proportion u : 1 - u along a reactor. ∂H/∂u and its derivative do not
    contain u; on the arc both vanish, x₂/x₁ = (10 - √10)/90, and u = 0.2271420827 is constant, the value of
    the literature.]],
  tags = "nonlinear control failure",
  index = 3, dof = 2, structural_index = 2, structural_dof = 3, verdict = "identically singular",
  remark = [[The derivative of ∂H/∂u contains u formally; the terms cancel (the Lie bracket of the two vector
    fields decides).]],
  to = 1, dt = 0.1, forms = { "", "acc", "ode", "project", "dummy", "baumgarte" },
  build = function()
    local x1, x2, l1, l2, u = vars "x1 x2 lambda1 lambda2 u"
    local H = l1*u*(10*x2 - x1) + l2*(u*(x1 - 10*x2) - (1 - u)*x2)
    local r = (10 - math.sqrt(10))/90                                   -- x2/x1
    local w = 1/(1/r - 8 - 10*r)                                        -- u
    return {
      model = dae { der(x1) ~ diff(H, l1), der(x2) ~ diff(H, l2), der(l1) ~ -diff(H, x1),
        der(l2) ~ -diff(H, x2),
        0 ~ diff(H, u), name = "catalyst mixing" },
      constraints = { diff(H, u), 10*l1*x2 - l2*x1 },
      fix = { [x1] = 1, [l2] = 1 },
      guess = { [x2] = 0.08, [l1] = 1.3, [u] = 0.2 },
      exact = { [x1] = exp(w*(10*r - 1)*t), [x2] = r*exp(w*(10*r - 1)*t),
        [l1] = exp((w*(9 - 1/r) + 1)*t)/(10*r),
        [l2] = exp((w*(9 - 1/r) + 1)*t), [u] = w + 0*t },
    }
  end,
}
