return {
  name = "crouzeix", order = 3,
  text = "Two stages, γ = (3+√3)/6: A-stable, order 3.",
  cite = "Crouzeix, thèse, Paris, 1975; Nørsett 1974; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.6",
  c = { "1/2+sqrt(3)/6", "1/2-sqrt(3)/6" },
  A = { { "1/2+sqrt(3)/6" }, { "-sqrt(3)/3", "1/2+sqrt(3)/6" } },
  b = { "1/2", "1/2" },
}
