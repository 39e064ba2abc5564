return {
  name = "bogacki_shampine", order = 3, embedded = 2,
  text = "Four stages, FSAL. A good explicit default at loose tolerance.",
  cite = "Bogacki & Shampine, Appl. Math. Lett. 2(4), 1989",
  c = { 0, "1/2", "3/4", 1 },
  A = { {}, { "1/2" }, { 0, "3/4" }, { "2/9", "1/3", "4/9" } },
  b = { "2/9", "1/3", "4/9", 0 },
  bhat = { "7/24", "1/4", "1/3", "1/8" },
}
