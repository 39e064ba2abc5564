-- Right, in his own notation and order.
local theta, m, g, l = var "theta", param "m", param "g", param "l"
energy = l*m*(l*theta.dot^2 - 2*g*(1 - 2*sin(theta/2)^2))/2

local p, q, pdot, qdot, force = vars "p q pdot qdot force"
pendulum = dae { p^2 + q^2 ~ l^2, der(qdot) ~ -force*q/m - g, m*der(pdot) + force*p ~ 0,
  pdot ~ der(p), qdot ~ der(q) }
index = 3.0
period = 2.00607
method = tableau { A = { { 0, 1 }, { 0, 0 } }, b = { "1/2", "1/2" }, c = { 1, 0 } }
higher = tableau { A = { { 0, 0, 0 }, { "1/2", 0, 0 }, { -1, 2, 0 } }, b = { "1/6", "2/3", "1/6" },
  c = { 0, "1/2", 1 } }
poles = tf({ 1 }, { 1, 3, 2 }):poles()
poles = { poles[2], poles[1] }
plant = idpoly { A = { 1, -0.7 }, B = { 0, 0.5 } }
