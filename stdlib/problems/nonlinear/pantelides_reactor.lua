return {
  title = "Exothermic reactor with a prescribed concentration",
  source = "Pantelides, SIAM J. Sci. Stat. Comput. 9(2), 1988; Brenan, Campbell & Petzold 1996, §1.3",
  statement = [[The cooling temperature T_c is to be found such that C follows u(t): C gives the rate R, R
    gives T, T gives T_c.]],
  tags = "nonlinear chemistry control",
  index = 3, dof = 0, structural_index = 3, structural_dof = 0, verdict = "valid",
  to = 1, dt = 0.05,
  build = function()
    local C, T, R, Tc = vars "C T R T_c"
    local u = input "u"
    local C0, T0, K1, K2, K3, K4, K5 = params "C_0=3 T_0=1 K1=1 K2=1 K3=1 K4=8 K5=2"
    local c = 1 + exp(-t)/2                 -- then R = 2 and T = K5/ln(K4 C/R)
    local T_exact = 2/log(4*c)
    return {
      model = dae { der(C) ~ K1*(C0 - C) - R, der(T) ~ K1*(T0 - T) + K2*R - K3*(T - Tc),
        0 ~ R - K4*exp(-K5/T)*C, 0 ~ C - u,
        name = "reactor" },
      constraints = { C - u, K1*(C0 - C) - u.dot - K4*exp(-K5/T)*C },
      guess = { [T] = 1.1, [C] = 1.5, [R] = 2, [Tc] = 0 },
      inputs = { [u] = c },
      exact = { [C] = c, [T] = T_exact, [R] = 2 + 0*t, [Tc] = 2*T_exact - 3 + der(T_exact) },
    }
  end,
}
