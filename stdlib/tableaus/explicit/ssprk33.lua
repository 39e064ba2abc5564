return {
  name = "ssprk33", order = 3,
  text = "Strong stability preserving: a convex combination of Euler steps, SSP coefficient 1.",
  cite = "Shu & Osher, J. Comput. Phys. 77, 1988",
  c = { 0, 1, "1/2" },
  A = { {}, { 1 }, { "1/4", "1/4" } },
  b = { "1/6", "1/6", "2/3" },
}
