return {
  title = "Isothermal stirred tank with an equilibrium reaction",
  source = "scripts/lecture/cstr.lua",
  statement = [[A ⇌ B in equilibrium, B → C. The rate R₁ is whatever keeps C_A = C_B/K_eq: it appears in no
    algebraic equation, so the index is 2, and R₁ = (K_eq F_a C_A0/V + k₂ C_B)/(1 + K_eq).]],
  tags = "lecture nonlinear chemistry",
  index = 2, dof = 3, structural_index = 2, structural_dof = 3, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local V, CA, CB, CC, R1, R2 = vars "V C_A C_B C_C R_1 R_2"
    local Fa, F = input "F_a", input "F"
    local CA0, K, k2 = params "C_A0=2 K_eq=3 k_2=0.4"
    return {
      model = dae { der(V) ~ Fa - F, der(CA) ~ Fa/V*(CA0 - CA) - R1, der(CB) ~ -Fa/V*CB + R1 - R2,
        der(CC) ~ -Fa/V*CC + R2, 0 ~ CA - CB/K, 0 ~ R2 - k2*CB, name = "isothermal CSTR" },
      constraints = { CA - CB/K },
      fix = { [V] = 2, [CB] = 1.5, [CC] = 0.1 },
      inputs = { [Fa] = 1, [F] = 1/2 },
      reference = { [V] = 3, [CA] = 0.33499446011385, [CB] = 1.0049833803415, [CC] = 0.70446660398903,
        [R1] = 0.60049833803417, [R2] = 0.40199335213662 },
    }
  end,
}
