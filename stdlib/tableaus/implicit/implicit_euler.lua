return {
  name = "implicit_euler", order = 1,
  text = "Implicit Euler: the slope at the end of the step; L-stable.",
  cite = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.3",
  c = { 1 },
  A = { { 1 } },
  b = { 1 },
}
