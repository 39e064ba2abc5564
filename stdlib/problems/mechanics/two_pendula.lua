return {
  title = "Two pendula, the tension of the first being the length of the second",
  source = "Pryce, BIT 41(2), 2001; Nedialkov & Pryce, BIT 45, 2005 (y downwards)",
  statement = [[The second pendulum has length L + c λ. It needs λ″, hence two more differentiations of the
    first constraint: index 5.]],
  tags = "mechanics nonlinear",
  index = 5, dof = 4, structural_index = 5, structural_dof = 4, verdict = "valid",
  to = 2, dt = 0.05,
  build = function()
    local x, y, lam, u, v, mu = vars "x y lambda u v mu"
    local G, L, c = params "G=1 L=1 c=0.1"
    local r = L + c*lam
    local tension = (x.dot^2 + y.dot^2 + G*y)/L^2            -- λ in terms of the states; λ′ = 3 G y′/L²
    return {
      model = dae { der(x, 2) ~ -x*lam, der(y, 2) ~ -y*lam + G, 0 ~ x^2 + y^2 - L^2,
        der(u, 2) ~ -u*mu, der(v, 2) ~ -v*mu + G, 0 ~ u^2 + v^2 - r^2, name = "two pendula" },
      constraints = { x^2 + y^2 - L^2, x*x.dot + y*y.dot, u^2 + v^2 - (L + c*tension)^2,
        u*u.dot + v*v.dot - (L + c*tension)*c*3*G*y.dot/L^2 },
      fix = { [x] = 0.6, [x.dot] = 0.4, [u] = 0.6, [u.dot] = 0.2 },
      guess = { [y] = 0.8, [y.dot] = -0.3, [lam] = 1, [v] = 0.9, [v.dot] = -0.2, [mu] = 1 },
      reference = { [x] = 0.28228466030627, [y] = 0.95933068884297, [lam] = 1.5279920665287,
        [u] = 0.16748377425913,
        [v] = 1.1405679270518, [mu] = 1.268109770732 },
    }
  end,
}
