return {
  title = "Four operational amplifiers in cascade, each a differentiator",
  source = [[Reißig, Proc. ECCTD 1999: the index of networks with controlled sources can be any; Günther &
    Feldmann, Surv. Math. Ind. 8, 1999]],
  statement = [[Every ideal amplifier differentiates its input: with n of them the index is n + 1, without any
    loop or cutset.]],
  tags = "linear circuit",
  index = 5, dof = 0, structural_index = 5, structural_dof = 0, verdict = "valid",
  to = 1, dt = 0.02,
  build = function()
    local v = var("v", 5)
    return {
      model = dae { v[1] ~ sin(t), v[2] ~ -der(v[1]), v[3] ~ -der(v[2])/2, v[4] ~ -der(v[3]),
        v[5] ~ -2*der(v[4]), name = "four differentiators" },
      constraints = { v[1] - sin(t), v[2] + cos(t), v[3] + sin(t)/2, v[4] - cos(t)/2 },
      fix = {},
      exact = { [v[1]] = sin(t), [v[2]] = -cos(t), [v[3]] = -sin(t)/2, [v[4]] = cos(t)/2, [v[5]] = sin(t) },
    }
  end,
}
