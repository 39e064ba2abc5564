-- The phase portrait of a pendulum with friction, and a Poincaré section of a driven oscillator.
theta = var "theta"
pendulum = dae { der(theta, 2) ~ -sin(theta) - 0.2*theta.dot }
portrait = phase(pendulum, theta, theta.dot, { xlim = { -7, 7 }, ylim = { -3, 3 },
  title = "Pendulum with friction", start = { { -6, 2.6 }, { 6, -2.6 }, { 2, 0 } }, to = 40 })
portrait:save "portrait.svg"
print(portrait.labels[2], portrait.labels[3])

x, v = vars "x v"
duffing = dae { der(x) ~ v, der(v) ~ -0.3*v + x - x^3 + 0.2*cos(1.2*t) }
sol = duffing:integrate { start = { x = 1, v = 0 }, to = 200, rtol = 1e-8, atol = 1e-8 }
print(poincare(sol, sin(1.2*t), x, v, { style = "dots", title = "Every period of the force" }))
