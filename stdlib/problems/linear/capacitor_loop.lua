return {
  title = "A loop of capacitors and a voltage source",
  source = "modified nodal analysis; index by topology: Tischendorf, Surv. Math. Ind. 8, 1999",
  statement = [[A loop of capacitors and sources makes the index 2: the current of the source contains the
    derivative of its voltage.]],
  tags = "linear circuit",
  index = 2, dof = 1, structural_index = 2, structural_dof = 1, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local e1, e2, i = vars "e1 e2 i"
    local v = input "v"
    local C1, C2, R = params "C1=1 C2=1 R=1"
    local e = (cos(t) + 2*sin(t) + 4*exp(-t/2))/5
    return {
      model = dae { C1*(der(e1) - der(e2)) + i ~ 0, C1*(der(e2) - der(e1)) + C2*der(e2) + e2/R ~ 0, e1 ~ v,
        name = "capacitor loop" },
      constraints = { e1 - v },
      fix = { [e2] = 1 },
      inputs = { [v] = sin(t) },
      exact = { [e1] = sin(t), [e2] = e, [i] = der(e) - cos(t) },
    }
  end,
}
