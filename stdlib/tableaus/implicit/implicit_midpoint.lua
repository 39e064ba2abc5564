return {
  name = "implicit_midpoint", order = 2,
  text = "Implicit midpoint rule, the Gauss method with one stage: symplectic and symmetric.",
  cite = "Hairer, Lubich & Wanner, Geometric Numerical Integration, 2nd ed., §II.1",
  c = { "1/2" },
  A = { { "1/2" } },
  b = { 1 },
}
