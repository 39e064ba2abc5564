return {
  title = "Car axis",
  source = "Mazzia & Magherini, Test Set for Initial Value Problem Solvers; reference in quadruple precision",
  statement = [[A rigid axis on two springs, one wheel on a flat road and one on a bumpy one; two constraints,
    one of them moving.]],
  tags = "mechanics nonlinear benchmark",
  index = 3, dof = 4, structural_index = 3, structural_dof = 4, verdict = "valid",
  to = 3, dt = 0.005,
  build = function()
    local xl, yl, xr, yr = vars "x_l y_l x_r y_r"
    local l1, l2 = vars "lambda1 lambda2"
    local k, g, L, L0 = params "k=1/2000 g=1 L=1 L_0=1/2"
    local yb = sin(10*t)/10
    local xb = sqrt(L^2 - yb^2)
    local Ll, Lr = sqrt(xl^2 + yl^2), sqrt((xr - xb)^2 + (yr - yb)^2)
    local fl, fr = (L0 - Ll)/Ll, (L0 - Lr)/Lr
    local c1, c2 = xb*xl + yb*yl, (xl - xr)^2 + (yl - yr)^2 - L^2
    return {
      model = dae {
        k*der(xl, 2) ~ fl*xl + l1*xb + 2*l2*(xl - xr), k*der(yl, 2) ~ fl*yl + l1*yb + 2*l2*(yl - yr) - k*g,
        k*der(xr, 2) ~ fr*(xr - xb) - 2*l2*(xl - xr), k*der(yr, 2) ~ fr*(yr - yb) - 2*l2*(yl - yr) - k*g,
        0 ~ c1, 0 ~ c2, name = "car axis" },
      constraints = { c1, c2, der(c1), der(c2) },
      fix = { [xl] = 0, [yl] = 1/2, [xr] = 1, [yr] = 1/2, [xl.dot] = -1/2, [yl.dot] = 0, [xr.dot] = -1/2,
        [yr.dot] = 0 },
      reference = { [xl] = 0.0493455784275242, [yl] = 0.496989460230008, [xr] = 1.04174252488543,
        [yr] = 0.373911027265366,
        [xl.dot] = -0.077058368403592, [yl.dot] = 0.00744686659206841, [xr.dot] = 0.0175568157535418,
        [yr.dot] = 0.7703410437796 },
    }
  end,
}
