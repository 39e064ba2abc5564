return {
  title = "Integrator with an ideal operational amplifier (Miller integrator)",
  source = "modified nodal analysis; circuits of this kind: Günther & Feldmann, Surv. Math. Ind. 8, 1999",
  statement = [[Resistor at the input, capacitor in the feedback: e₃ = -1/(R C) ∫ v dt. The current j of the
    amplifier equals that of the source: the sum of two node equations is free of derivatives.]],
  tags = "linear circuit failure",
  index = 1, dof = 1, structural_index = 2, structural_dof = 1, verdict = "valid",
  remark = [[Structure is right about the free value and gives only an upper bound of the index: (2) + (3) is
    algebraic, and e₂′ = 0 needs one differentiation.]],
  to = 2, dt = 0.1,
  build = function()
    local e1, e2, e3, i, j = vars "e1 e2 e3 i j"
    local v = input "v"
    local R, C = params "R=2 C=3"
    return {
      model = dae { (e1 - e2)/R + i ~ 0, (e2 - e1)/R + C*(der(e2) - der(e3)) ~ 0,
        C*(der(e3) - der(e2)) + j ~ 0, e1 ~ v, e2 ~ 0,
        name = "integrator" },
      constraints = { e2 },
      fix = { [e3] = 1/6 },
      inputs = { [v] = sin(t) },
      exact = { [e1] = sin(t), [e2] = 0*t, [e3] = cos(t)/6, [i] = -sin(t)/2, [j] = sin(t)/2 },
    }
  end,
}
