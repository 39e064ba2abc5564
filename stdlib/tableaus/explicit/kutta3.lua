return {
  name = "kutta3", order = 3,
  text = "Kutta's method of order 3: Simpson's rule.",
  cite = "Kutta, Z. Math. Phys. 46, 1901",
  c = { 0, "1/2", 1 },
  A = { {}, { "1/2" }, { -1, 2 } },
  b = { "1/6", "2/3", "1/6" },
}
