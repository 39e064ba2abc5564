return {
  name = "sdirk4", order = 4, embedded = 3,
  text = "Five stages, γ = 1/4: L-stable and stiffly accurate.",
  cite = "Hairer & Wanner, Solving ODEs II, 2nd ed., Table IV.6.5 (the code SDIRK4)",
  c = { "1/4", "3/4", "11/20", "1/2", 1 },
  A = {
    { "1/4" },
    { "1/2", "1/4" },
    { "17/50", "-1/25", "1/4" },
    { "371/1360", "-137/2720", "15/544", "1/4" },
    { "25/24", "-49/48", "125/16", "-85/12", "1/4" },
  },
  b = { "25/24", "-49/48", "125/16", "-85/12", "1/4" },
  bhat = { "59/48", "-17/96", "225/32", "-85/12" },
}
