-- A tour of Pendula: five minutes through everything that exists.   pendula scripts/tour.lua
-- Each step prints what the line above it gives.

print "── 1 Symbols and expressions ──"
x, y = vars "x y"                       -- unknown functions of time
m, g, l, k = params "m=1 g=9.81 l=2 k=5"
e = m*x.dot^2/2 - k*x^2/2
print(e)
print(der(e))                           -- the total time derivative
print(gradient(e, vec{x, y}).T)
print(expand((x + 1)^3), simplify((x^2 - 1)/(x - 1)), simplify(sin(x)^2 + cos(x)^2))
print(1/3 + rational "1/6", sqrt(2), 2*pi)      -- exact
print(evaluate(e, { [x] = 0.5, [x.dot] = 2 }))
print(e:latex())
p = var("p", 3)
print(p.T*p.dot, cross(p, vec{0, 0, 1}).T, norm(p))
print(jacobian(vec{x*y, sin(x)}, vec{x, y}))
h = func "h"
print(diff(h(x, y), x))                 -- a formal partial derivative
print(ifelse(lt(x, 0), -x, x))
f = fn({x, y}, x*y + 1)                 -- compiled
print(f(2, 3))

print "\n── 2 Lagrange mechanics ──"
th = var "theta"
pend = lagrange { q = {th}, T = m*l^2*th.dot^2/2, V = -m*g*l*cos(th) }
print(pend)
M = param "M"
s = var "s"
cart = lagrange { q = {s, th},
  T = (M + m)*s.dot^2/2 + m*l^2*th.dot^2/2 + m*l*s.dot*th.dot*cos(th), V = -m*g*l*cos(th) }
print(cart.matrix_form)

print "\n── 3 DAEs ──"
v, z = var("v", 3), var "z"
L = param("L", 1)
ball = dae { der(p) ~ v, m*der(v) ~ -m*g*vec{0, 0, 1} - z*p, 0 ~ (p.T*p - L^2)/2,
  name = "spherical pendulum" }
print(ball)
print(ball:constraints())
low = ball:reduce "acc"
print(low:trace())
at = ball:init { fix = { [p] = {1, 0, 0}, [v] = {0, 1, 0} } }
print(at:ledger())

print(ball:structure())
trap = dae.linear { E = {{1, 1, 0}, {0, 0, 1}, {1, 1, 1}}, A = eye(3),
  name = "exam 3(d): purely structural analysis fails" }
print(trap:structure())
print(trap:pencil())
for _, form in ipairs { "acc", "ggl", "baumgarte", "ode", "project", "dummy" } do
  local reduced = ball:reduce(form)
  print(("%-10s %-15s index %d"):format(form, reduced.kind, reduced:index()))
end

print "\n── 4 Tableaus ──"
print(rk.rk4)
print(rk.gauss(2))
mine = tableau [[ 0   |
                  1/2 | 1/2
                      | 0   1 ]]
print("order " .. mine:order())

print "\n── 5 Integration ──"
sol = low:integrate { start = at, to = 2, method = rk.gauss(2), dt = 0.01 }
print(sol(vstack(p, v), 2).T)
print(sol.status)
print(sol:drift())
kept = ball:reduce():integrate { start = at, to = 2, method = rk.rk4, dt = 0.01 }
print(kept:drift())
swing = pend:integrate { start = { theta = 2, [th.dot] = 0 }, to = 10, method = rk.gauss(2), dt = 0.02 }
print(("energy at the start %.6f, after 10 s %.6f"):format(swing(pend.energy, 0), swing(pend.energy, 10)))

-- no method: it is chosen
free = pend:integrate { start = { theta = 2, [th.dot] = 0 }, to = 10, rtol = 1e-9,
  events = { { when = th, direction = -1 } } }
print(#free.events .. " swings through the bottom, the first at t = " .. ("%.9f"):format(free.events[1].t))
print(rk.radau(2):report())
hot = newton { r = { x^2 + y^2 - 5, x*y - 2 }, x = { x, y }, start = { 3, 0.5 } }
print(hot)

print "\n── 6 Linear systems and identification ──"
motor = tf({ 2 }, { 1, 3, 2 })
print(motor:poles())
print(motor:c2d(0.1))
seed, us, ys = 7, {}, { 0, 0 }                       -- y(t) = 0.6 y(t-1) + 2 u(t-1), no noise
for i = 1, 40 do seed = (1103515245*seed + 12345) % 2147483648  us[i] = seed/1073741824 - 1 end
for i = 2, 40 do ys[i] = 0.6*ys[i-1] + 2*us[i-1] end
print(arx(iddata { y = ys, u = us, Ts = 1 }, { na = 1, nb = 1, nk = 1 }))

print "\n── 7 Plots ──"
plot(swing, { th, th.dot }, { title = "a pendulum let go at 2 rad" }):show()

print "\n── 8 Errors say what to do ──"
print(select(2, pcall(function() return ball:integrate { start = at, to = 1, method = rk.rk4,
  dt = 0.01 } end)))
print(select(2, pcall(function() return ball:init { fix = { [p] = {2, 0, 0}, [v] = {0, 1, 0} } } end)))
print(select(2, pcall(function() return if_lese(x) end)))
