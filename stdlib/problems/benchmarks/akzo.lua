return {
  title = "Chemical Akzo Nobel problem",
  source = "Mazzia & Magherini, Test Set for Initial Value Problem Solvers",
  statement = [[Five reactions with an oxygen inflow and an equilibrium. y₂ is small: with loose tolerances it
    turns negative under its root.]],
  tags = "chemistry nonlinear benchmark",
  index = 1, dof = 5, structural_index = 1, structural_dof = 5, verdict = "valid",
  to = 180, dt = 0.1,
  build = function()
    local y = var("y", 6)
    local k1, k2, k3, k4, K, klA, p, Ks,
      H = params "k1=18.7 k2=0.58 k3=0.09 k4=0.42 K=34.4 klA=3.3 p=0.9 Ks=115.83 H=737"
    local r1, r2, r3 = k1*y[1]^4*sqrt(y[2]), k2*y[3]*y[4], k2/K*y[1]*y[5]
    local r4, r5, Fin = k3*y[1]*y[4]^2, k4*y[6]^2*sqrt(y[2]), klA*(p/H - y[2])
    return {
      model = dae { der(y[1]) ~ -2*r1 + r2 - r3 - r4, der(y[2]) ~ -r1/2 - r4 - r5/2 + Fin,
        der(y[3]) ~ r1 - r2 + r3,
        der(y[4]) ~ -r2 + r3 - 2*r4, der(y[5]) ~ r2 - r3 + r5, 0 ~ Ks*y[1]*y[4] - y[6], name = "Akzo Nobel" },
      constraints = {},
      fix = { [y[1]] = 0.444, [y[2]] = 0.00123, [y[3]] = 0, [y[4]] = 0.007, [y[5]] = 0 },
      reference = { [y[1]] = 0.1150794920661702, [y[2]] = 0.001203831471567715, [y[3]] = 0.1611562887407974,
        [y[4]] = 0.0003656156421249283, [y[5]] = 0.01708010885264404, [y[6]] = 0.004873531310307455 },
    }
  end,
}
