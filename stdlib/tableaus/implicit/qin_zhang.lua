return {
  name = "qin_zhang", order = 2,
  text = "Two implicit midpoint steps of half the size as one method: diagonally implicit and symplectic.",
  cite = "Qin & Zhang, J. Comput. Math. 10, 1992",
  c = { "1/4", "3/4" },
  A = { { "1/4" }, { "1/2", "1/4" } },
  b = { "1/2", "1/2" },
}
