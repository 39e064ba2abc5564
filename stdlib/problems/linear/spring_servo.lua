return {
  title = "Two masses and a spring: the force that makes the far mass follow a path",
  source = [[servo constraint as in Blajer & Kołodziejczyk, Multibody Syst. Dyn. 11, 2004; Altmann, Betsch &
    Yang, ibid. 36, 2016]],
  statement = [[The force acts on mass 1, the path is prescribed for mass 2, the spring stands between them:
    index 5, two more than a constraint whose force acts where it is imposed.]],
  tags = "linear mechanics control",
  index = 5, dof = 0, structural_index = 5, structural_dof = 0, verdict = "valid",
  to = 1, dt = 0.1,
  build = function()
    local x1, x2, F = vars "x1 x2 F"
    local m1, m2, k = params "m1=1 m2=2 k=4"
    return {
      model = dae { m1*der(x1, 2) ~ F - k*(x1 - x2), m2*der(x2, 2) ~ k*(x1 - x2), 0 ~ x2 - sin(t),
        name = "servo constraint" },
      constraints = { x2 - sin(t), x2.dot - cos(t), x1 - x2 + m2*sin(t)/k, x1.dot - x2.dot + m2*cos(t)/k },
      exact = { [x1] = sin(t)/2, [x2] = sin(t), [F] = -5*sin(t)/2 },
    }
  end,
}
