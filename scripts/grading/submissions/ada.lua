-- Right, in the notation of the lecture.
theta = var "theta"
m, g, l = params "m=1 g=9.81 l=1"
energy = m*l^2*theta.dot^2/2 - m*g*l*cos(theta)

local x, y, u, v, z = vars "x y u v z"
pendulum = dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 }
index = pendulum:index()
period = 2*math.pi*math.sqrt(1/9.81)
method = rk.heun
higher = rk.rk4
poles = { -1, -2 }

local d, seed = { y = {}, u = {} }, 5
for k = 1, 300 do
  seed = seed*48271 % 2147483647
  d.u[k] = seed % 2 == 0 and 1 or -1
  d.y[k] = 0.7*(d.y[k - 1] or 0) + 0.5*(d.u[k - 1] or 0) + 0.02*math.cos(31*k)
end
plant = arx(iddata { y = d.y, u = d.u, Ts = 1 }, { na = 1, nb = 1, nk = 1 })
