return {
  title = "Transistor amplifier",
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §VI.1; Mazzia & Magherini, Test Set for IVP Solvers",
  statement = [[M y′ = f(t, y) with a singular M of 2×2 blocks. No variable is algebraic: the sums of the row
    pairs are. Index 1, but five of the eight initial values are free.]],
  tags = "circuit nonlinear benchmark failure",
  index = 1, dof = 5, structural_index = 0, structural_dof = 8, verdict = "identically singular",
  remark = "The two rows of every capacitor between nodes cancel, as those of E in exam 3(d).",
  to = 0.2, dt = 0.0001,
  build = function()
    local y = var("y", 8)
    local Ub, UF, alpha, beta, R0, R = params "U_b=6 U_F=0.026 alpha=0.99 beta=1e-6 R_0=1000 R=9000"
    local C = { 1e-6, 2e-6, 3e-6, 4e-6, 5e-6 }
    local function g(v) return beta*(exp(v/UF) - 1) end
    local Ue = sin(200*pi*t)/10
    local f = {
      (y[1] - Ue)/R0, y[2]/R + (y[2] - Ub)/R + (1 - alpha)*g(y[2] - y[3]), y[3]/R - g(y[2] - y[3]),
      (y[4] - Ub)/R + alpha*g(y[2] - y[3]), y[5]/R + (y[5] - Ub)/R + (1 - alpha)*g(y[5] - y[6]),
        y[6]/R - g(y[5] - y[6]),
      (y[7] - Ub)/R + alpha*g(y[5] - y[6]), y[8]/R,
    }
    local function between(c, a, b) return c*(der(b) - der(a)) end
    local end_values = { -0.5562145012262709e-2, 3.006522471903042, 2.849958788608128, 2.926422536206241,
      2.704617865010554,
      2.761837778393145, 4.770927631616772, 1.236995868091548 }
    local reference = {}
    for i = 1, 8 do reference[y[i]] = end_values[i] end
    return {
      model = dae { between(C[1], y[1], y[2]) ~ f[1], between(C[1], y[2], y[1]) ~ f[2],
        -C[2]*der(y[3]) ~ f[3],
        between(C[3], y[4], y[5]) ~ f[4], between(C[3], y[5], y[4]) ~ f[5], -C[4]*der(y[6]) ~ f[6],
        between(C[5], y[7], y[8]) ~ f[7], between(C[5], y[8], y[7]) ~ f[8], name = "transistor amplifier" },
      constraints = { f[1] + f[2], f[4] + f[5], f[7] + f[8] },
      fix = { [y[2]] = 3, [y[3]] = 3, [y[5]] = 3, [y[6]] = 3, [y[8]] = 0 },
      guess = { [y[1]] = 0, [y[4]] = 6, [y[7]] = 6 },
      reference = reference,
    }
  end,
}
