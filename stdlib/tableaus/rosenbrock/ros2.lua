return {
  name = "ros2", order = 2, embedded = 1, dae_order = 2,
  text = "Two stages, L-stable, order 2 with any approximate Jacobian too.",
  cite = "Verwer, Spee, Blom & Hundsdorfer, SIAM J. Sci. Comput. 20, 1999",
  gamma = "1-1/sqrt(2)",
  A = { {}, { "1/(1-1/sqrt(2))" } },
  C = { {}, { "-2/(1-1/sqrt(2))" } },
  m = { "3/(2*(1-1/sqrt(2)))", "1/(2*(1-1/sqrt(2)))" },
  mhat = { "1/(1-1/sqrt(2))", 0 },
}
