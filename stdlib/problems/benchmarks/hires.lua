return {
  title = "HIRES: high irradiance response of photomorphogenesis",
  source = "Schäfer 1975; Mazzia & Magherini, Test Set for Initial Value Problem Solvers",
  statement = "A stiff ODE with eight species; the small components y₁ to y₅ count as much as the others.",
  tags = "chemistry nonlinear benchmark",
  index = 0, dof = 8, structural_index = 0, structural_dof = 8, verdict = "valid",
  to = 321.8122, dt = 0.2,
  build = function()
    local y = var("y", 8)
    local r = 280*y[6]*y[8]
    local end_values = { .7371312573325668e-3, .1442485726316185e-3, .5888729740967575e-4,
      .1175651343283149e-2,
      .2386356198831331e-2, .6238968252742796e-2, .2849998395185769e-2, .2850001604814231e-2 }
    local fix, reference = {}, {}
    for i = 1, 8 do
      fix[y[i]] = i == 1 and 1 or i == 8 and 0.0057 or 0
      reference[y[i]] = end_values[i]
    end
    return {
      model = dae { der(y[1]) ~ -1.71*y[1] + 0.43*y[2] + 8.32*y[3] + 0.0007,
        der(y[2]) ~ 1.71*y[1] - 8.75*y[2],
        der(y[3]) ~ -10.03*y[3] + 0.43*y[4] + 0.035*y[5], der(y[4]) ~ 8.32*y[2] + 1.71*y[3] - 1.12*y[4],
        der(y[5]) ~ -1.745*y[5] + 0.43*(y[6] + y[7]),
          der(y[6]) ~ -r + 0.69*y[4] + 1.71*y[5] - 0.43*y[6] + 0.69*y[7],
        der(y[7]) ~ r - 1.81*y[7], der(y[8]) ~ -r + 1.81*y[7], name = "HIRES" },
      constraints = {}, fix = fix, reference = reference,
    }
  end,
}
