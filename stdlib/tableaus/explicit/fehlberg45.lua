return {
  name = "fehlberg45", order = 4, embedded = 5,
  text = "Six stages, order 4(5): the pair of RKF45, which continues with the lower order.",
  cite = "Fehlberg, Computing 6, 1970; Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., Table II.5.1",
  c = { 0, "1/4", "3/8", "12/13", 1, "1/2" },
  A = {
    {},
    { "1/4" },
    { "3/32", "9/32" },
    { "1932/2197", "-7200/2197", "7296/2197" },
    { "439/216", -8, "3680/513", "-845/4104" },
    { "-8/27", 2, "-3544/2565", "1859/4104", "-11/40" },
  },
  b = { "25/216", 0, "1408/2565", "2197/4104", "-1/5" },
  bhat = { "16/135", 0, "6656/12825", "28561/56430", "-9/50", "2/55" },
}
