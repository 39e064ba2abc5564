return {
  name = "ralston", order = 2,
  text = "The two-stage method of order 2 with the smallest error bound.",
  cite = "Ralston, Math. Comp. 16, 1962",
  c = { 0, "2/3" },
  A = { {}, { "2/3" } },
  b = { "1/4", "3/4" },
}
