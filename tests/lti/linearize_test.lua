-- sys:linearize(at) against models linearised by hand, and against small motions of the nonlinear model.

test("a pendulum at rest has the poles ±√(g/L) i, upside down ±√(g/L)", function()
  local p, v = var("p", 2), var("v", 2)
  local z = var "z"
  local m, g, L = params "m=1 g=9.81 L=2"
  local sys = dae{ der(p) ~ v, m*der(v) ~ -m*g*vec{0, 1} - z*p, 0 ~ (p.T*p - L^2)/2 }
  local down = sys:init{ fix = { [p] = { 0, -2 }, [v] = { 0, 0 } } }
  local w = math.sqrt(9.81/2)
  local G = sys:linearize(down)
  expect(G:poles()):near({ complex(0, -w), complex(0, w) }, 1e-14)
  expect(G.states):equals { "p₁", "v₁" }
  expect(G.A):equals(mat{{0, 1}, {"-4.905", 0}})
  local up = sys:init{ fix = { [p] = { 0, 2 }, [v] = { 0, 0 } } }
  expect(sys:linearize(up):poles()):near({ -w, w }, 1e-14)
  -- at the side of the circle the vertical coordinate moves freely
  expect(sys:linearize(down, { outputs = { z, p[1], der(v[1]) } }).C):equals(mat{{0, 0}, {1, 0},
    {"-4.905", 0}})
  -- parameters can be inputs: the multiplier at rest is m g/L
  expect(sys:linearize(down, { inputs = { m }, outputs = { z } }).D(1, 1)):equals(rational("981/200"))
end)

test("by hand: a mass on a spring, a model of index 1 with an algebraic variable", function()
  local x, f = vars "x f"
  local u = input "u"
  local m, d, k = params "m=2 d=3 k=5"
  local sys = dae{ m*der(x, 2) ~ f + u, 0 ~ f + k*x + d*der(x) }
  local at = sys:init{ fix = { x = 0, [x.dot] = 0 }, inputs = { [u] = 0 } }
  local G = sys:linearize(at, { outputs = { x, f } })
  expect(G.A):equals(mat{{0, 1}, {"-5/2", "-3/2"}})
  expect(G.B):equals(vec{0, "1/2"})
  expect(G.C):equals(mat{{1, 0}, {-5, -3}})
  expect(G:channel("x", "u"):tf().den):equals(vec{1, "3/2", "5/2"})
  expect(G.inputs):equals { "u" }
end)

test("the cart with a pendulum, both equilibria", function()
  local x, th = vars "x theta"
  local F = input "F"
  local M, m, l, g = params "M=2 m=1 l=1 g=10"
  local cart = lagrange{ q = vec{x, th}, V = -m*g*l*cos(th), Q = { F, 0 },
    T = M/2*x.dot^2 + m/2*((x.dot + l*th.dot*cos(th))^2 + (l*th.dot*sin(th))^2) }
  local rest = { x = 0, theta = 0, [x.dot] = 0, [th.dot] = 0 }
  local G = cart:linearize(cart:init{ fix = rest, inputs = { [F] = 0 } })
  -- x″ = (m g θ + F)/M, θ″ = -((M+m) g θ + F)/(M l): textbook, e.g. Åström & Murray, Feedback Systems, Ex.
  -- 3.2
  expect(G.A):equals(mat{{0, 0, 1, 0}, {0, 0, 0, 1}, {0, 5, 0, 0}, {0, -15, 0, 0}})
  expect(G.B):equals(vec{0, 0, "1/2", "-1/2"})
  local there = { x = 0, theta = 0, F = 0, [x.dot] = 0, [th.dot] = 0 }
  expect(cart:linearize(there).A):equals(G.A)             -- a point holds inputs, too
  there.F = nil
  expect(function() cart:linearize(there) end):fails
    "the point gives no value of the input 'F'; write sys:linearize{ …, F = 0 }"
  local r1, r2 = input "r1", input "r2"
  local x1 = var "x1"
  local two = dae { der(x1) ~ -x1 + r1 + 2*r2 }
  expect(function() two:linearize{ x1 = 0, r1 = 1 } end):fails
    "the point gives no value of the input 'r2'; write sys:linearize{ …, r2 = 0 }"
  expect(function() two:linearize{ x1 = 0 } end):fails
    "no value of the inputs 'r1', 'r2'; write sys:linearize{ …, r1 = 0, r2 = 0 }"
  expect(two:linearize{ x1 = 0, [r1] = 0, r2 = 0 }.B):equals(mat{{1, 2}})
  there[F] = 0
  expect(cart:linearize(there).B):equals(G.B)
  expect(function() cart:init{ fix = { theta = 0, F = 0 } } end):fails
    "fix: 'F' is an input of the model; its value goes into inputs = { F = … }"
  expect(function() cart:init{ fix = { [m] = 0 } } end):fails "'m' is a parameter of the model"
  local up = cart:init{ fix = { x = 0, theta = pi, [x.dot] = 0, [th.dot] = 0 }, inputs = { [F] = 0 } }
  local H = cart:linearize(up)
  expect(H:poles()):near({ -math.sqrt(15), 0, 0, math.sqrt(15) }, 1e-12)
  expect(H:controllability().full):equals(true)
  expect(H:is_stable()):equals(false)
end)

test("two masses at rest: eight poles of a double pendulum in space", function()
  local q = var("q", 6)
  local m, g, R, L = params "m=1 g=9.81 R=1 L=0.5"
  local p1, p2 = q:slice(1, 3), q:slice(4, 6)
  local chain = lagrange{ q = q, T = m/2*q.dot.T*q.dot, V = m*g*(p1[3] + p2[3]),
    C = { (p1.T*p1 - R^2)/2, (norm(p2 - p1)^2 - L^2)/2 } }
  local at = chain:init{ fix = { [q] = { 0, 0, -1, 0, 0, -1.5 }, [q.dot] = { 0, 0, 0, 0, 0, 0 } } }
  local G = chain:linearize(at)
  expect(G.order):equals(8)
  -- planar double pendulum: m₁=m₂: ω⁴ R L - 2 g (R+L) ω² + 2 g² = 0
  local b, c = 2*9.81*1.5/0.5, 2*9.81^2/0.5
  local w1, w2 = math.sqrt((b - math.sqrt(b*b - 4*c))/2), math.sqrt((b + math.sqrt(b*b - 4*c))/2)
  local im = G:poles().im
  expect({ im[1], im[2], im[3], im[4] }):near({ -w2, -w2, -w1, -w1 }, 1e-10)
  expect(G:poles().re):near(zeros(8, 1), 1e-12)
  expect(G:stability().verdict):equals "stable, not asymptotically"
end)

test("small motions of the nonlinear model follow the linear one", function()
  local q = var("q", 2)
  local u = input "u"
  local sys = lagrange{ q = q, T = q.dot.T*q.dot/2, V = 10*q[2], C = { (q.T*q - 1)/2 }, Q = { u, 0 } }
  local at = sys:init{ fix = { [q] = { 0, -1 }, [q.dot] = { 0, 0 } }, inputs = { [u] = 0 } }
  local G = sys:linearize(at, { outputs = { q[1] } })
  local eps = 1e-4
  local start = sys:init{ fix = { [q[1]] = 0, [q[1].dot] = 0 }, guess = { [q] = { 0, -1 } },
    inputs = { [u] = eps } }
  local sol = sys:reduce("ode"):integrate{ start = start, to = 2, method = rk.gauss(3), dt = 0.02,
    inputs = { [u] = eps } }
  local r = G:step(linspace(0, 2, 101))
  expect(sol(q[1], 2)/eps):near(r.y(101, 1), 1e-6)        -- the next term is O(ε²)
end)

test("a point that is no equilibrium is said to be none", function()
  local x = var "x"
  local sys = dae{ der(x) ~ -x^2 }
  local G = sys:linearize{ x = 3 }
  expect(G.A(1, 1)):equals(-6)
  expect(G.notes[1]):equals "no equilibrium: deviations from the trajectory at t = 0, frozen there"
  -- a pendulum in motion: the coordinate that moves freely is p₂ here
  local p, v = var("p", 2), var("v", 2)
  local z = var "z"
  local pend = dae{ der(p) ~ v, der(v) ~ -10*vec{0, 1} - z*p, 0 ~ (p.T*p - 4)/2 }
  local moving = pend:init{ fix = { [p] = { 2, 0 }, [v] = { 0, 1 } } }
  local H = pend:linearize(moving)
  expect(H.states):equals { "p₂", "v₂" }
  -- p₂″ = -10 - z p₂ with 4 z = v₁² + v₂² - 10 p₂, v₁ = -p₂v₂/p₁: ∂/∂p₂ of it at (0, 1) is -z = -1/4
  expect(H.A):equals(mat{{0, 1}, {"-1/4", 0}})
end)

test("the index-2 reactor of the lecture keeps its three degrees of freedom", function()
  local C0, T, R, CA = vars "C_B T R C_A"
  local Fa, k2 = params "F_a=1 k2=0.5"
  local CA0, T0, Keq = params "C_A0=2 T_0=300 K_eq=3"
  local V = var "V"
  -- V′ = Fa - F; fast reaction kept in equilibrium: 0 = C_A - C_B/K_eq, R the unknown rate
  local sys = dae{ der(V) ~ Fa - Fa*V, der(CA) ~ Fa/V*(CA0 - CA) - R, der(C0) ~ -Fa/V*C0 + R - k2*C0,
    0 ~ CA - C0/Keq }
  expect(sys:index()):equals(2)
  -- at rest: V = 1, R = Fa (CA0 - CA)/V, Fa CB/V + k2 CB = R, CB = Keq CA
  local ca = 2/(1 + 3*1.5)
  local at = sys:init{ fix = { V = 1, C_A = ca }, guess = { C_B = 3*ca, R = 1 } }
  local G = sys:linearize(at)
  expect(G.order):equals(2)
  -- (1 + Keq) CA′ = Fa/V (CA0 - CA) - (Fa/V + k2) Keq CA
  expect(G:poles()):near({ -(1 + 3*1.5)/4, -1 }, 1e-9)
end)

test("errors name what does not fit", function()
  local x = var "x"
  local u = input "u"
  local sys = dae{ der(x) ~ -x + u }
  local at = sys:init{ fix = { x = 0 }, inputs = { [u] = 0 } }
  expect(function() sys:linearize() end):fails "a start: sys:linearize(sys:init{ … })"
  expect(function() sys:linearize(at, { inputs = "v" }) end):fails "v"
  expect(function() sys:linearize(at, { outputs = { var "w2" } }) end):fails "w"
  expect(function() sys:linearize(at, { input = u }) end):fails "Did you mean 'inputs'?"
  expect(function() sys:linearize(3) end):fails "start"
  local w = var "w3"
  local two = dae{ der(x) ~ w, 0 ~ x - u }
  local start = two:init{ inputs = { [u] = 0 } }
  expect(function() two:linearize(start, { outputs = { w } }) end):fails "depends on derivatives of the input"
  expect(two:linearize(start, { outputs = { x } }).D(1, 1)):equals(1)
end)

test("options of linearize stand in a table of their own", function()
  local x, v = vars "x v"
  local F, k = input "F", param("k", 2)
  local sys = dae { der(x) ~ v, der(v) ~ -k*x - v + F }
  expect(function() sys:linearize{ x = 0, v = 0, outputs = x } end)
    :fails "sys:linearize({ x = 0, … }, { outputs = … })"
  expect(function() sys:linearize{ x = 0, v = 0, inputs = { F = 0 } } end):fails "sys:linearize{ …, F = 0 }"
  expect(function() sys:linearize({ x = 0, v = 0 }, { inputs = { F = 0 } }) end):fails "belongs to the point"
  expect(function() sys:linearize{ start = { x = 0 } } end):fails "the point itself is the first argument"
  expect(#sys:linearize({ x = 0, v = 0, F = 0 }, { inputs = "F", outputs = { x } }).outputs):equals(1)
end)
