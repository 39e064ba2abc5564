return {
  name = "rodas3", order = 3, embedded = 2,
  text = "Four stages, L-stable and stiffly accurate, for loose tolerances.",
  cite = "Sandu, Verwer, Blom, Spee, Carmichael & Potra, Atmos. Environ. 31, 1997",
  gamma = "1/2",
  A = { {}, { 0 }, { 2, 0 }, { 2, 0, 1 } },
  C = { {}, { 4 }, { 1, -1 }, { 1, -1, "-8/3" } },
  m = { 2, 0, 1, 1 },
  mhat = { 2, 0, 1, 0 },
}
