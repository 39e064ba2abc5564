return {
  name = "trapezoid", order = 2,
  text = "Implicit trapezoidal rule, Lobatto IIIA with two stages: A-stable and symmetric.",
  cite = [[Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.3; Crank & Nicolson, Proc. Camb.
    Phil. Soc. 43, 1947]],
  c = { 0, 1 },
  A = { { 0, 0 }, { "1/2", "1/2" } },
  b = { "1/2", "1/2" },
}
