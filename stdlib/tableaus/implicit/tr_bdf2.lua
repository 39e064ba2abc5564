-- γ = 2 - √2, d = γ/2, w = √2/4.
return {
  name = "tr_bdf2", order = 2, embedded = 3,
  text = [[A trapezoidal step of length γ = 2 - √2, then BDF 2: L-stable and stiffly accurate, an ESDIRK
    method.]],
  cite = [[Bank, Coughran, Fichtner, Grosse, Rose & Smith, IEEE Trans. 32, 1985; Hosea & Shampine, Appl.
    Numer. Math. 20, 1996]],
  c = { 0, "2-sqrt(2)", 1 },
  A = { {}, { "1-sqrt(2)/2", "1-sqrt(2)/2" }, { "sqrt(2)/4", "sqrt(2)/4", "1-sqrt(2)/2" } },
  b = { "sqrt(2)/4", "sqrt(2)/4", "1-sqrt(2)/2" },
  bhat = { "1/3-sqrt(2)/12", "1/3+sqrt(2)/4", "1/3-sqrt(2)/6" },
}
