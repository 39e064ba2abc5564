return {
  title = "Differentiator with an ideal operational amplifier",
  source = "modified nodal analysis; circuits of this kind: Günther & Feldmann, Surv. Math. Ind. 8, 1999",
  statement = [[Capacitor at the input, resistor in the feedback: e₃ = -R C v′. Output and currents contain
    the derivative of the input.]],
  tags = "linear circuit",
  index = 2, dof = 0, structural_index = 2, structural_dof = 0, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local e1, e2, e3, i, j = vars "e1 e2 e3 i j"
    local v = input "v"
    local R, C = params "R=2 C=3"
    return {
      model = dae { C*(der(e1) - der(e2)) + i ~ 0, C*(der(e2) - der(e1)) + (e2 - e3)/R ~ 0,
        (e3 - e2)/R + j ~ 0, e1 ~ v, e2 ~ 0,
        name = "differentiator" },
      constraints = { e1 - v, e2 },
      inputs = { [v] = sin(t) },
      exact = { [e1] = sin(t), [e2] = 0*t, [e3] = -6*cos(t), [i] = -3*cos(t), [j] = 3*cos(t) },
    }
  end,
}
