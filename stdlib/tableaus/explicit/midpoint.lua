return {
  name = "midpoint", order = 2,
  text = "Explicit midpoint rule: the slope in the middle of an Euler step.",
  cite = "Runge, Math. Annalen 46, 1895; Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.1",
  c = { 0, "1/2" },
  A = { {}, { "1/2" } },
  b = { 0, 1 },
}
