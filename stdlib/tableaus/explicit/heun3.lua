return {
  name = "heun3", order = 3,
  text = "Heun's method of order 3: the weights of a Radau quadrature.",
  cite = "Heun, Z. Math. Phys. 45, 1900; Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., Table II.1.1",
  c = { 0, "1/3", "2/3" },
  A = { {}, { "1/3" }, { 0, "2/3" } },
  b = { "1/4", 0, "3/4" },
}
