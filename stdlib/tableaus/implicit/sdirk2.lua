return {
  name = "sdirk2", order = 2,
  text = "Two stages, γ = 1 - √2/2: L-stable and stiffly accurate.",
  cite = "Alexander, SIAM J. Numer. Anal. 14, 1977",
  c = { "1-sqrt(2)/2", 1 },
  A = { { "1-sqrt(2)/2" }, { "sqrt(2)/2", "1-sqrt(2)/2" } },
  b = { "sqrt(2)/2", "1-sqrt(2)/2" },
}
