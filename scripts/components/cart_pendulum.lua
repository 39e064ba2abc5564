-- An inverted pendulum on a cart, held upright by a linear-quadratic regulator that runs every 20 ms.
local l, s = components.translational, components.signals
local M, m, len, g, Ts = 1, 0.2, 0.5, 9.81, 0.02
local x, th = vars "x th"
local cart = lagrange { q = { x, th }, V = m*g*len*cos(th),
  T = M*x.dot^2/2 + m/2*((x.dot - len*cos(th)*th.dot)^2 + len^2*sin(th)^2*th.dot^2) }
  :ports { push = { l.flange, s = x } }
local u = input "u"
local open = model { P = cart, F = l.signal_force{}, connect("F.flange", "P.push"), connect("F.f", u) }
local upright = { ["P.x"] = 0, ["P.th"] = 0, ["P.x'"] = 0, ["P.th'"] = 0 }
local G = open:linearize(open:init{ fix = upright, inputs = { [u] = 0 } })
print("poles, upright:", G:poles())
local sampled = c2d(ss({ { 0, 0, 1, 0 }, { 0, 0, 0, 1 }, { 0, m*g/M, 0, 0 }, { 0, (M + m)*g/(M*len), 0, 0 } },
  { { 0 }, { 0 }, { 1/M }, { 1/(M*len) } }, eye(4), zeros(4, 1)), Ts)
local K = dlqr(sampled, diag(vec{ 10, 10, 1, 1 }), mat{ { 1 } })
print("K =", K)
local px, pth = var "P.x", var "P.th"
local loop = model { P = cart, F = l.signal_force{}, hold = s.sampler{ Ts = Ts },
  connect("F.flange", "P.push"),
  connect("hold.y", "F.f"),
  connect(-(K(1, 1)*px + K(1, 2)*pth + K(1, 3)*der(px) + K(1, 4)*der(pth)), "hold.u") }
local sol = loop:integrate{ to = 6, rtol = 1e-9, atol = 1e-11,
  start = { ["P.x"] = 0, ["P.th"] = 0.2, ["P.x'"] = 0, ["P.th'"] = 0 } }
print(("at 2 s: x = %.8f, angle %.8f"):format(sol(loop.P.x, 2), sol(loop.P.th, 2)))
print("scipy:  x = -0.14183510, angle 0.01130063")
print(("at 6 s: angle %.1e"):format(math.abs(sol(loop.P.th, 6))))
print(plot(sol, { loop.P.x, loop.P.th, loop.hold.y/100 }, { labels = { "x", "angle", "force/100" } }))
