return {
  name = "rk4", order = 4,
  text = "The classical method of order four.",
  cite = "Kutta, Z. Math. Phys. 46, 1901; Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., Table II.1.2",
  c = { 0, "1/2", "1/2", 1 },
  A = { {}, { "1/2" }, { 0, "1/2" }, { 0, 0, 1 } },
  b = { "1/6", "1/3", "1/3", "1/6" },
}
