return {
  title = "Two shafts and a rigid gear",
  source = "textbook example; see Cellier & Kofman, Continuous System Simulation, Springer 2006, ch. 7",
  statement = [[The gear ratio n ties two inertias together: one inertia J₁ + J₂/n² swings against the spring
    k at ω² = k/(J₁ + J₂/n²).]],
  tags = "linear mechanics",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 2, dt = 0.05,
  build = function()
    local a, b, z = vars "phi1 phi2 z"
    local J1, J2, n, k = params "J1=1 J2=4 n=2 k=8"
    return {
      model = dae { J1*der(a, 2) ~ -k*a - z, J2*der(b, 2) ~ n*z, 0 ~ a - n*b, name = "gear" },
      constraints = { a - n*b, a.dot - n*b.dot },
      fix = { [a] = 1, [a.dot] = 0 },
      exact = { [a] = cos(2*t), [b] = cos(2*t)/2, [z] = -4*cos(2*t) },
    }
  end,
}
