-- Stick-slip: a mass on a belt with dry friction, held by a spring. Popp, Forschung im Ingenieurwesen 64,
-- 1998.
local l = components.translational

local belt = model {
  belt = l.position{ s = 0.1*t }, m = l.mass{ m = 1, s0 = 0, v0 = 0.1 }, c = l.spring{ k = 1 },
    wall = l.fixed{},
  R = l.friction{ F = 0.5, Fs = 1 },
  connect("wall.flange", "c.a"), connect("c.b", "m.flange", "R.b"), connect("R.a", "belt.flange") }

print(("index %d of all equations, %d free initial values"):format(belt:index(), belt:dof()))
local sol = belt:integrate{ to = 40, rtol = 1e-8 }
print(sol.status)
-- sticks until the spring pulls with 1 N: t = 10
print(("sticks: v(9.9) = %.6f, s(9.9) = %.6f"):format(sol(belt.m.v, 9.9), sol(belt.m.s, 9.9)))
-- slides: s = 0.5 + 0.5 cos τ + 0.1 sin τ, until v is 0.1 again
local tau = 1
print(("slides: s(11) = %.6f, by hand %.6f"):format(sol(belt.m.s, 11),
  0.5 + 0.5*math.cos(tau) + 0.1*math.sin(tau)))
print(plot(sol, { belt.m.s, belt.m.v }))
