return {
  name = "heun", order = 2,
  text = "Explicit trapezoidal rule: the mean of the slopes at both ends.",
  cite = "Heun, Z. Math. Phys. 45, 1900; Runge, Math. Annalen 46, 1895",
  c = { 0, 1 },
  A = { {}, { 1 } },
  b = { "1/2", "1/2" },
}
