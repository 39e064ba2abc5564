-- A double pendulum: equations of motion, a run that keeps its energy, a figure and an animation.
q = var("q", 2)
m, g, l = params "m=1 g=9.81 l=1"
p1 = vec(l*sin(q[1]), -l*cos(q[1]))
p2 = p1 + vec(l*sin(q[2]), -l*cos(q[2]))
v1, v2 = der(p1), der(p2)
pendulum = lagrange { q = q, T = m/2*(v1.T*v1 + v2.T*v2), V = m*g*(p1[2] + p2[2]) }
print(pendulum.kind, pendulum:dof())

sol = pendulum:integrate { start = { [q] = { 2, 1 }, [q.dot] = { 0, 0 } }, to = 6, rtol = 1e-9, atol = 1e-9 }
energy = sol(pendulum.energy)
print("energy kept to 1e-6:", math.abs(energy[#energy] - energy[1]) < 1e-6)

print(plot(sol, p2[1], p2[2], { title = "Path of the lower mass", equal = true }))
film = animate(sol, { p1, p2 }, { title = "Double pendulum" })
film:save "double_pendulum.svg"
print(film)
