return {
  title = "Index 2 with a moving null space, on which BDF may fail",
  source = "Gear & Petzold, SIAM J. Numer. Anal. 21(4), 1984; Brenan, Campbell & Petzold 1996, §2 and §3",
  statement = [[Index 2 and uniquely solvable for every η, although the local pencil E(t), A(t) depends on it.
    Implicit Euler multiplies errors by η/(1 + η) per step: it diverges for η < -1/2, and for η = -1 it has no
    solution at all.]],
  tags = "linear failure",
  index = 2, dof = 0, structural_index = 1, structural_dof = 1, verdict = "identically singular",
  remark = "Equation (1) differentiated and equation (2) have the same leading part x₁′ + η t x₂′.",
  to = 1, dt = 0.1,
  build = function()
    local x1, x2 = vars "x1 x2"
    local eta = param("eta", "-1/4")
    return {
      model = dae { x1 + eta*t*x2 ~ exp(-t), der(x1) + eta*t*der(x2) + (1 + eta)*x2 ~ 0,
        name = "Gear and Petzold" },
      constraints = { x1 + eta*t*x2 - exp(-t), x2 - exp(-t) },
      exact = { [x1] = exp(-t)*(1 + t/4), [x2] = exp(-t) },
    }
  end,
}
