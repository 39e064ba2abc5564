-- Ten more models of the books: rotating frames, robots, tops, pulleys, ladders, in the form in which they
-- are printed.
local m, M, g, R, l, k, J, a, Om, tau, om, al = params "m M g R l k J a Omega tau omega alpha"
local m1, m2, m3, m4, l1, l2, lc1, lc2, I1, I2, I3, J1, J2 = params "m1 m2 m3 m4 l1 l2 lc1 lc2 I1 I2 I3 J1 J2"
local th, phi, psi, x, y = vars "theta phi psi x y"
local x1, x2, x3, x4, th1, th2, q1, q2 = vars "x1 x2 x3 x4 theta1 theta2 q1 q2"

local has = require "printed"

test("bead on a rotating hoop", function()
  local p = R*vec { sin(th)*cos(Om*t), sin(th)*sin(Om*t), -cos(th) }
  local hoop = lagrange { q = { th }, T = m/2*der(p).T*der(p), V = m*g*p[3] }
  has(hoop, "m R² θ″ = m R (R Ω² cos(θ) - g) sin(θ)")
  has(hoop:reduce "ode", "θ″ = (R Ω² cos(θ) - g) sin(θ)/R")
end)

test("Foucault's pendulum", function()
  local w, lambda = param "w", param "lambda"
  local v = vec { x.dot - w*sin(lambda)*y, y.dot + w*sin(lambda)*x }
  has(lagrange { q = { x, y }, T = m/2*v.T*v, V = m*g/(2*l)*(x^2 + y^2) }:reduce "ode",
    "x″ = 2 w y′ sin(λ) + (w² sin(λ)² - g/l) x", "y″ = (w² sin(λ)² - g/l) y - 2 w x′ sin(λ)")
end)

test("pendulum with a support that oscillates", function()
  local p = vec { l*sin(th), a*cos(om*t) - l*cos(th) }
  has(lagrange { q = { th }, T = m/2*der(p).T*der(p), V = m*g*p[2] }:reduce "ode",
    "θ″ = (a ω² cos(ω t) - g) sin(θ)/l")
end)

test("slider and crank with a rod without mass turn past the dead centres", function()
  -- (2 sin p)² is the mass matrix's entry of the rod: 0 in line with the crank, where the constraint holds p
  local p, r = th, 1
  local slide = -r*sin(phi)*phi.dot - 2*sin(p)*p.dot
  local sys = lagrange { q = { phi, p }, T = phi.dot^2/6 + slide^2/2, V = 0, C = { r*sin(phi) - 2*sin(p) } }
  local at = sys:init { fix = { [phi] = 0.3, [phi.dot] = 1 }, guess = { [p] = 0.1 } }
  for _, form in ipairs { "project", "dummy", "ggl" } do
    local run = sys:reduce(form):integrate { start = at, to = 5, rtol = 1e-9, atol = 1e-9 }
    expect(run.status):equals "finished"
    expect(run(phi, 5)):near(4.496817152, 1e-6)  -- φ′ from the energy, by scipy (rtol 1e-11)
  end
end)

test("two-link robot with gravity and torques", function()
  local t1, t2 = params "tau1 tau2"
  local c1 = vec { lc1*cos(q1), lc1*sin(q1) }
  local c2 = vec { l1*cos(q1) + lc2*cos(q1 + q2), l1*sin(q1) + lc2*sin(q1 + q2) }
  local robot = lagrange { q = { q1, q2 }, V = m1*g*c1[2] + m2*g*c2[2], Q = { t1, t2 },
    T = m1/2*der(c1).T*der(c1) + m2/2*der(c2).T*der(c2) + I1/2*q1.dot^2 + I2/2*(q1.dot + q2.dot)^2 }
  has(robot, "q₁″ (2 m₂ l₁ lc₂ cos(q₂) + m₁ lc₁² + m₂ l₁² + m₂ lc₂² + I₁ + I₂)",
    "q₁″ (m₂ l₁ lc₂ cos(q₂) + m₂ lc₂² + I₂) + (m₂ lc₂² + I₂) q₂″ = τ₂ - m₂ l₁ lc₂ q₁′² sin(q₂) "
    .. "- g m₂ lc₂ cos(q₁ + q₂)")
  has(robot:reduce "ode",
    "/(m₂² l₁² lc₂² sin(q₂)² + m₁ m₂ lc₁² lc₂² + m₁ lc₁² I₂ + m₂ l₁² I₂ + m₂ lc₂² I₁ + I₁ I₂)")
end)

test("inertia-wheel pendulum", function()
  local c, d = vec { lc1*sin(th), lc1*cos(th) }, vec { l1*sin(th), l1*cos(th) }
  local wheel = lagrange { q = { th, phi }, V = m1*g*c[2] + m2*g*d[2], Q = { 0, tau },
    T = m1/2*der(c).T*der(c) + m2/2*der(d).T*der(d) + J1/2*th.dot^2 + J2/2*(th.dot + phi.dot)^2 }
  has(wheel, "(m₁ lc₁² + m₂ l₁² + J₁ + J₂) θ″ + J₂ φ″ = g (m₁ lc₁ + m₂ l₁) sin(θ)", "J₂ θ″ + J₂ φ″ = τ")
  has(wheel:reduce "ode", "θ″ = (g (m₁ lc₁ + m₂ l₁) sin(θ) - τ)/(m₁ lc₁² + m₂ l₁² + J₁)")
end)

test("heavy symmetric top in Euler's angles", function()
  local top = lagrange { q = { phi, th, psi }, V = m*g*l*cos(th),
    T = I1/2*(th.dot^2 + phi.dot^2*sin(th)^2) + I3/2*(psi.dot + phi.dot*cos(th))^2 }
  has(top, "I₁ θ″ = (I₁ φ′² cos(θ) - I₃ φ′ (φ′ cos(θ) + ψ′) + m g l) sin(θ)",
    "I₃ φ″ cos(θ) + I₃ ψ″ = I₃ θ′ φ′ sin(θ)")
  has(top:reduce "ode", "φ″ = θ′ (I₃ (φ′ cos(θ) + ψ′) - 2 I₁ φ′ cos(θ))/(I₁ sin(θ))")
end)

test("disc that rolls without slipping, down an incline and as a yo-yo", function()
  local disc = lagrange { q = { x, th }, T = m/2*x.dot^2 + J/2*th.dot^2, V = -m*g*x*sin(al),
    C = { x - R*th } }
  has(disc:reduce "ode", "x″ = m g R² sin(α)/(m R² + J)", "θ″ = m g R sin(α)/(m R² + J)")
  local yoyo = lagrange { q = { x, th }, T = m/2*x.dot^2 + J/2*th.dot^2, V = -m*g*x, C = { x - R*th } }
  has(yoyo:reduce "ode", "x″ = m g R²/(m R² + J)", "θ″ = m g R/(m R² + J)")
  has(yoyo:reduce "ode":trace(), "z = m g J/(m R² + J)")
end)

test("pulleys with movable blocks: no fraction inside a fraction", function()
  local block = lagrange { q = { x1, x2, x3 }, T = (m1*x1.dot^2 + m2*x2.dot^2 + m3*x3.dot^2)/2,
    V = -g*(m1*x1 + m2*x2 + m3*x3), C = { 2*x1 + x2 + x3 - l } }
  has(block:reduce "ode", "x₁″ = g (m₁ m₂ + m₁ m₃ - 4 m₂ m₃)/(m₁ m₂ + m₁ m₃ + 4 m₂ m₃)",
    "x₂″ = g (m₁ m₂ - 3 m₁ m₃ + 4 m₂ m₃)/(m₁ m₂ + m₁ m₃ + 4 m₂ m₃)")
  has(block:reduce "ode":trace(), "z = 4 g m₁ m₂ m₃/(m₁ m₂ + m₁ m₃ + 4 m₂ m₃)")
  local double = lagrange { q = { x1, x2, x3, x4 },
    T = (m1*x1.dot^2 + m2*x2.dot^2 + m3*x3.dot^2 + m4*x4.dot^2)/2,
    V = -g*(m1*x1 + m2*x2 + m3*x3 + m4*x4), C = { x1 + x4 - l1, x2 + x3 - 2*x4 - l2 } }
  has(double:reduce "ode",
    "x₁″ = g (m₁ m₂ + m₁ m₃ - 4 m₂ m₃ - m₂ m₄ - m₃ m₄)/(m₁ m₂ + m₁ m₃ + 4 m₂ m₃ + m₂ m₄ + m₃ m₄)")
  has(lagrange { q = { x, y }, T = m1/2*x.dot^2 + m2/2*(y.dot - x.dot)^2 + m3/2*(x.dot + y.dot)^2,
    V = -m1*g*x - m2*g*(y - x) + m3*g*(x + y) }:reduce "ode",
    "x″ = g (m₁ m₂ + m₁ m₃ - 4 m₂ m₃)/(m₁ m₂ + m₁ m₃ + 4 m₂ m₃)", "y″ = 2 g m₁ (m₂ - m₃)/")
end)

test("coupled pendula, and masses in a chain of springs", function()
  has(lagrange { q = { th1, th2 }, T = m*l^2/2*(th1.dot^2 + th2.dot^2),
    V = -m*g*l*(cos(th1) + cos(th2)) + k/2*a^2*(sin(th1) - sin(th2))^2 },
    "m l² θ₁″ = -m g l sin(θ₁) - k a² (sin(θ₁) - sin(θ₂)) cos(θ₁)")
  has(lagrange { q = { x1, x2, x3 }, T = (m1*x1.dot^2 + m2*x2.dot^2 + m3*x3.dot^2)/2,
    V = k/2*((x2 - x1)^2 + (x3 - x2)^2) }:reduce "ode", "x₂″ = k (x₁ - 2 x₂ + x₃)/m₂")
end)

test("rod that slides in a corner, with one coordinate and with three", function()
  local p = vec { l/2*sin(th), l/2*cos(th) }
  has(lagrange { q = { th }, T = m/2*der(p).T*der(p) + m*l^2/24*th.dot^2, V = m*g*p[2] }:reduce "ode",
    "θ″ = 3 g sin(θ)/(2 l)")
  has(lagrange { q = { x, y, th }, T = m/2*(x.dot^2 + y.dot^2) + m*l^2/24*th.dot^2, V = m*g*y,
    C = { x - l/2*sin(th), y - l/2*cos(th) } }:reduce "ode", "θ″ = 3 g sin(θ)/(2 l)",
    "x″ = (3 g cos(θ) - 2 l θ′²) sin(θ)/4")
end)

test("the derivation of the double pendulum, line by line as on a sheet", function()
  local p = vec { l1*sin(th1), -l1*cos(th1) }
  local q = p + vec { l2*sin(th2), -l2*cos(th2) }
  local trace = lagrange { q = { th1, th2 }, T = m1/2*der(p).T*der(p) + m2/2*der(q).T*der(q),
    V = m1*g*p[2] + m2*g*q[2] }:trace()
  has(trace, "       = l₁² (m₁ + m₂) θ₁′²/2 + m₂ l₁ l₂ θ₁′ θ₂′ cos(θ₁ - θ₂) + m₂ l₂² θ₂′²/2",
    "∂L/∂θ₁′ = l₁² (m₁ + m₂) θ₁′ + m₂ l₁ l₂ θ₂′ cos(θ₁ - θ₂)",
    "∂L/∂θ₂ = m₂ l₁ l₂ θ₁′ θ₂′ sin(θ₁ - θ₂) - g m₂ l₂ sin(θ₂)")
end)

test("cart, pendulum and robot: momenta are collected by velocities", function()
  local p = vec { x + l*sin(th), l*cos(th) }
  local cart = lagrange { q = { x, th }, T = M/2*x.dot^2 + m/2*der(p).T*der(p), V = m*g*p[2] }:trace()
  has(cart, "       = m l² θ′²/2 + m l θ′ x′ cos(θ) + (m + M) x′²/2", "∂L/∂x′ = m l θ′ cos(θ) + (m + M) x′",
    "d/dt ∂L/∂x′ = m l θ″ cos(θ) + (m + M) x″ - m l θ′² sin(θ)")
  local chain = var("q", 6)
  has(lagrange { q = chain, T = m/2*chain.dot.T*chain.dot, V = m*g*chain[3] }:trace(), "T = m q′ᵀq′/2",
    "∂L/∂q′ = m q′")
end)
