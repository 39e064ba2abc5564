return {
  title = "Two tanks joined by a wide pipe",
  source = "textbook example; see Cellier & Kofman, Continuous System Simulation, Springer 2006, ch. 7",
  statement = [[The levels are equal, the flow q through the pipe is whatever keeps them so: one level is
    free, not two.]],
  tags = "linear",
  index = 2, dof = 1, structural_index = 2, structural_dof = 1, verdict = "valid",
  to = 2, dt = 0.1,
  build = function()
    local h1, h2, q = vars "h1 h2 q"
    local A1, A2, a, inflow = params "A1=1 A2=3 a=2 q_in=4"
    return {
      model = dae { A1*der(h1) ~ inflow - q, A2*der(h2) ~ q - a*h2, 0 ~ h1 - h2, name = "two tanks" },
      constraints = { h1 - h2 },
      fix = { [h1] = 1 },
      exact = { [h1] = 2 - exp(-t/2), [h2] = 2 - exp(-t/2), [q] = 4 - exp(-t/2)/2 },
    }
  end,
}
