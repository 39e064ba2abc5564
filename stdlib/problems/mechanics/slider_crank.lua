return {
  title = "Slider-crank mechanism",
  source = "textbook multibody example; Haug, Computer-Aided Kinematics and Dynamics, 1989",
  statement = [[Crank angle θ, angle φ of the connecting rod, sliding mass m, in a horizontal plane: the loop
    closes with r sin θ + l sin φ = 0. One degree of freedom; with T constant θ(t) is a quadrature, which gave
    the reference values.]],
  tags = "mechanics nonlinear",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 2, dt = 0.02,
  build = function()
    local theta, phi = vars "theta phi"
    local m, J1, J2, r, l = params "m=1 J1=1 J2=0.5 r=1 l=2"
    local s = r*cos(theta) + l*cos(phi)
    local C = r*sin(theta) + l*sin(phi)
    return {
      model = lagrange { q = {theta, phi}, T = J1/2*theta.dot^2 + J2/2*phi.dot^2 + m/2*der(s)^2, C = { C },
        name = "slider-crank" },
      constraints = { C, der(C) },
      fix = { [theta] = 0.5, [theta.dot] = 2 },
      guess = { [phi] = 0 },
      reference = { [theta] = 4.588787432133904, [phi] = 0.5191997704619394,
        [theta.dot] = 1.850998716247914 },
    }
  end,
}
