return {
  title = "Jay's index-3 test problem",
  source = "Jay, Appl. Numer. Math. 17, 1995",
  statement = [[Hessenberg form of size three with a known solution, to measure the order of methods on index
    3.]],
  tags = "nonlinear",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 0.5, dt = 0.025,
  build = function()
    local y1, y2, z1, z2, u = vars "y1 y2 z1 z2 u"
    return {
      model = dae { der(y1) ~ 2*y1*y2*z1*z2, der(y2) ~ -y1*y2*z2^2, der(z1) ~ (y1*y2 + z1*z2)*u,
        der(z2) ~ -y1*y2^2*z2^2*u,
        0 ~ y1*y2^2 - 1, name = "Jay, index 3" },
      constraints = { y1*y2^2 - 1, y2*z1 - y1*z2 },
      fix = { [y1] = 1, [z1] = 1 },
      guess = { [y2] = 1, [z2] = 1, [u] = 1 },
      exact = { [y1] = exp(2*t), [y2] = exp(-t), [z1] = exp(2*t), [z2] = exp(-t), [u] = exp(t) },
    }
  end,
}
