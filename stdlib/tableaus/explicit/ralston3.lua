return {
  name = "ralston3", order = 3,
  text = "The three-stage method of order 3 with the smallest error bound.",
  cite = "Ralston, Math. Comp. 16, 1962",
  c = { 0, "1/2", "3/4" },
  A = { {}, { "1/2" }, { 0, "3/4" } },
  b = { "2/9", "1/3", "4/9" },
}
