-- A cart with an inverted pendulum: linearised, a regulator by lqr, the loop closed around the full model.
q = var("q", 2)                                     -- position of the cart, angle from upright
M, m, l, g = params "M=1 m=0.1 l=0.5 g=9.81"
F = input "F"
tip = vec(q[1] + l*sin(q[2]), l*cos(q[2]))
v = der(tip)
cart = lagrange { q = q, T = M*q.dot[1]^2/2 + m*(v.T*v)/2, V = m*g*tip[2], Q = vec(F, 0) }

at = cart:init { fix = { [q] = { 0, 0 }, [q.dot] = { 0, 0 } }, inputs = { F = 0 } }
G = cart:linearize(at)
K = lqr(G, diag(vec(1, 10, 1, 1)), 1)
print(K.rows, K.cols)

states = vstack(q, q.dot)
closed = dae { cart, F ~ -(K*states)[1] }
sol = closed:integrate { start = { [q] = { 0, 0.3 }, [q.dot] = { 0, 0 } }, to = 12 }
print("upright again:", math.abs(sol:final(q[2])) < 1e-3)
print(plot(sol, { q, F }, { right = { 3 }, title = "Cart and pole" }))
