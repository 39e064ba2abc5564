return {
  title = "A cutset of inductors and a current source",
  source = "modified nodal analysis; index by topology: Tischendorf, Surv. Math. Ind. 8, 1999",
  statement = [[Where only inductors and current sources meet, the node voltage contains the derivative of the
    source: index 2.]],
  tags = "linear circuit",
  index = 2, dof = 1, structural_index = 2, structural_dof = 1, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local i1, i2, e = vars "i1 i2 e"
    local I = input "I"
    local L1, L2, R = params "L1=1 L2=1 R=1"
    local c = (cos(t) + 2*sin(t) + 4*exp(-t/2))/5
    return {
      model = dae { i1 + i2 ~ I, L1*der(i1) ~ e, L2*der(i2) ~ e - R*i2, name = "inductor cutset" },
      constraints = { i1 + i2 - I },
      fix = { [i2] = 1 },
      inputs = { [I] = sin(t) },
      exact = { [i1] = sin(t) - c, [i2] = c, [e] = (cos(t) + c)/2 },
    }
  end,
}
