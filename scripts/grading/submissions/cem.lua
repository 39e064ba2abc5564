-- A sign, a model of index 1, a method of order 1, then an error.
local theta, m, g, l = var "theta", param "m", param "g", param "l"
energy = m*l^2*theta.dot^2/2 + m*g*l*cos(theta)
pendulum = dae { der(theta, 2) ~ -g/l*sin(theta) }
index = 1
period = 2
method = rk.midpoint
higher = rk.euler
poles = { -1, 2 }
plant = pendlum
