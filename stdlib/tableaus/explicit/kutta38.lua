return {
  name = "kutta38", order = 4,
  text = "The 3/8 rule: smaller error constants than rk4.",
  cite = "Kutta, Z. Math. Phys. 46, 1901; Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., Table II.1.2",
  c = { 0, "1/3", "2/3", 1 },
  A = { {}, { "1/3" }, { "-1/3", 1 }, { 1, -1, 1 } },
  b = { "1/8", "3/8", "3/8", "1/8" },
}
