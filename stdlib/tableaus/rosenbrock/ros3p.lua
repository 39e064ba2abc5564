-- g = 1/γ = 3 - √3, γ = 1/2 + √3/6. The paper's embedded method (of order 2) has the same stability function
-- as the method: its error estimate is 0 for every linear equation, so it is left out.
return {
  name = "ros3p", order = 3,
  text = "Three stages, A-stable; no order reduction on parabolic problems.",
  cite = "Lang & Verwer, BIT 41, 2001",
  gamma = "1/2+sqrt(3)/6",
  A = { {}, { "3-sqrt(3)" }, { "3-sqrt(3)", 0 } },
  C = {
    {}, { "-(3-sqrt(3))^2" },
    { "-(3-sqrt(3))*(1+(3-sqrt(3))*(2-(3-sqrt(3))/2))", "-(3-sqrt(3))*(2-(3-sqrt(3))/2)" },
  },
  m = { "(3-sqrt(3))*(1+(3-sqrt(3))*(2/3-(3-sqrt(3))/6))", "(3-sqrt(3))*(2/3-(3-sqrt(3))/6)",
    "(3-sqrt(3))/3" },
}
