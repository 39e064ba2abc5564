-- The models of every course, with the equations as textbooks print them.
local m, M, g, G, R, l, k, J, Jb, F, tau = params "m M g G R l k J Jb F tau"
local m1, m2, l1, l2 = params "m1 m2 l1 l2"
local x, r, th, phi = vars "x r theta phi"     -- terms stand in the order of declaration

local has = require "printed"

test("double pendulum", function()
  local th1, th2 = vars "theta1 theta2"
  local p = vec{ l1*sin(th1), -l1*cos(th1) }
  local q = p + vec{ l2*sin(th2), -l2*cos(th2) }
  local double = lagrange { q = { th1, th2 }, T = m1/2*der(p).T*der(p) + m2/2*der(q).T*der(q),
    V = m1*g*p[2] + m2*g*q[2] }
  has(double,
    "l₁² (m₁ + m₂) θ₁″ + m₂ l₁ l₂ θ₂″ cos(θ₁ - θ₂) = -l₁ (m₂ l₂ θ₂′² sin(θ₁ - θ₂) + g (m₁ + m₂) sin(θ₁))",
    "m₂ l₁ l₂ θ₁″ cos(θ₁ - θ₂) + m₂ l₂² θ₂″ = m₂ l₂ (l₁ θ₁′² sin(θ₁ - θ₂) - g sin(θ₂))")
  has(double:reduce "ode", "/(l₁ (m₂ sin(θ₁ - θ₂)² + m₁))", "/(l₂ (m₂ sin(θ₁ - θ₂)² + m₁))")
end)

test("cart and pendulum", function()
  local p = vec{ x + l*sin(th), l*cos(th) }
  local cart = lagrange { q = { x, th }, T = M/2*x.dot^2 + m/2*der(p).T*der(p), V = m*g*p[2], Q = { F, 0 } }
  has(cart, "(m + M) x″ + m l θ″ cos(θ) = m l θ′² sin(θ) + F", "m l x″ cos(θ) + m l² θ″ = m g l sin(θ)")
  has(cart:reduce "ode", "x″ = (m l θ′² sin(θ) - m g sin(θ) cos(θ) + F)/(m sin(θ)² + M)",
    "θ″ = (g (m + M) sin(θ) - (m l θ′² sin(θ) + F) cos(θ))/(l (m sin(θ)² + M))")
end)

test("spherical pendulum", function()
  local p = vec{ l*sin(th)*cos(phi), l*sin(th)*sin(phi), -l*cos(th) }
  local ball = lagrange { q = { th, phi }, T = m/2*der(p).T*der(p), V = m*g*p[3] }
  has(ball, "m l² θ″ = m l (l φ′² cos(θ) - g) sin(θ)", "m l² φ″ sin(θ)² = -2 m l² θ′ φ′ sin(θ) cos(θ)")
  has(ball:reduce "ode", "θ″ = (l φ′² cos(θ) - g) sin(θ)/l", "φ″ = -2 θ′ φ′/tan(θ)")
end)

test("Furuta pendulum", function()
  local a, b = vars "alpha beta"
  local p = vec{ R*cos(a) - l*sin(b)*sin(a), R*sin(a) + l*sin(b)*cos(a), l*cos(b) }
  local furuta = lagrange { q = { a, b }, T = J/2*a.dot^2 + m/2*der(p).T*der(p), V = m*g*p[3],
    Q = { tau, 0 } }
  has(furuta, "α″ (m (l² sin(β)² + R²) + J) + m R l β″ cos(β) = m R l β′² sin(β) - 2 m l² α′ β′ sin(β) "
    .. "cos(β) + τ",
    "m R l α″ cos(β) + m l² β″ = m l (l α′² cos(β) + g) sin(β)")
  has(furuta:reduce "ode", "/(m (R² + l²) sin(β)² + J)")
end)

test("ball and beam", function()
  local p = vec{ r*cos(th), r*sin(th) }
  local beam = lagrange { q = { r, th }, V = m*g*p[2], Q = { 0, tau },
    T = m/2*der(p).T*der(p) + Jb/(2*R^2)*r.dot^2 + J/2*th.dot^2 }
  has(beam, "(m + Jb/R²) r″ = m (r θ′² - g sin(θ))", "θ″ (m r² + J) = τ - 2 m r r′ θ′ - m g r cos(θ)")
  has(beam:reduce "ode", "r″ = m R² (r θ′² - g sin(θ))/(m R² + Jb)",
    "θ″ = (τ - 2 m r r′ θ′ - m g r cos(θ))/(m r² + J)")
end)

test("Atwood's machine, with one coordinate and with a rope as constraint", function()
  local x1, x2 = vars "x1 x2"
  has(lagrange { q = { x }, T = (m1 + m2)/2*x.dot^2, V = m1*g*x - m2*g*x }, "(m₁ + m₂) x″ = g (m₂ - m₁)")
  local rope = lagrange { q = { x1, x2 }, T = m1/2*x1.dot^2 + m2/2*x2.dot^2, V = -m1*g*x1 - m2*g*x2,
    C = { x1 + x2 - l } }
  local ode = rope:reduce "ode"
  has(ode, "x₁″ = g (m₁ - m₂)/(m₁ + m₂)", "x₂″ = g (m₂ - m₁)/(m₁ + m₂)")
  has(ode:trace(), "z = 2 g m₁ m₂/(m₁ + m₂)")
end)

test("elastic pendulum", function()
  has(lagrange { q = { r, th }, T = m/2*(r.dot^2 + r^2*th.dot^2), V = -m*g*r*cos(th) + k/2*(r - l)^2 },
    "m r″ = m r θ′² - k (r - l) + m g cos(θ)", "m r² θ″ = -m r (2 r′ θ′ + g sin(θ))")
end)

test("Kepler's problem in polar coordinates", function()
  local kepler = lagrange { q = { r, phi }, T = m/2*(r.dot^2 + r^2*phi.dot^2), V = -G*m*M/r }
  has(kepler, "m r″ = m (r φ′² - M G/r²)", "m r² φ″ = -2 m r r′ φ′")
  has(kepler:reduce "ode", "r″ = r φ′² - M G/r²", "φ″ = -2 r′ φ′/r")
end)

test("two masses on a rod", function()
  local x1, x2 = vars "x1 x2"
  local rod = lagrange { q = { x1, x2 }, T = m1/2*x1.dot^2 + m2/2*x2.dot^2, C = { x1 - x2 - l },
    Q = { F, 0 } }
  local ode = rod:reduce "ode"
  has(ode, "x₁″ = F/(m₁ + m₂)", "x₂″ = F/(m₁ + m₂)")
  has(ode:trace(), "z = F m₂/(m₁ + m₂)")
end)

test("friction, rolling, rotating frames and several multipliers", function()
  local x2, x3, y1, y2 = vars "x2 x3 y1 y2"
  local c, mu, al, Om, rho, m3 = params "c mu alpha Omega rho m3"
  local p = vec { x*cos(al), -x*sin(al) }
  has(lagrange { q = { x }, T = m/2*x.dot^2, V = -m*g*x*sin(al),
    Q = generalized_force({ x }, { { p, -mu*m*g*cos(al)*vec { cos(al), -sin(al) } } }) },
    "m x″ = m g (sin(α) - μ cos(α))")
  has(lagrange { q = { x, th }, T = m/2*x.dot^2 + m*R^2/4*th.dot^2, V = -m*g*x*sin(al), C = { x - R*th } }
    :reduce "ode", "x″ = 2 g sin(α)/3")
  has(lagrange { q = { th }, T = m*l^2/2*th.dot^2, V = -m*g*l*cos(th), Q = { -c*th.dot } },
    "m l² θ″ = -c θ′ - m g l sin(θ)")
  has(lagrange { q = { th }, T = m*R^2/2*(th.dot^2 + Om^2*sin(th)^2), V = -m*g*R*cos(th) },
    "m R² θ″ = m R (R Ω² cos(θ) - g) sin(θ)")
  has(lagrange { q = { th }, T = 3*m/4*(R - rho)^2*th.dot^2, V = -m*g*(R - rho)*cos(th) }:reduce "ode",
    "θ″ = -2 g sin(θ)/(3 (R - ρ))")
  has(lagrange { q = { th }, T = m*l^2/6*th.dot^2, V = m*g*l/2*cos(th) }:reduce "ode",
    "θ″ = 3 g sin(θ)/(2 l)")
  has(lagrange { q = { x, x2 }, T = m/2*(x.dot^2 + x2.dot^2), V = k/2*x^2 + k/2*(x2 - x)^2 + k/2*x2^2 },
    "m x″ = k (x₂ - 2 x)")
  local A, om, f = param "A", param "omega", input "f"
  local swing = vec { A*cos(om*t) + l*sin(th), -l*cos(th) }
  has(lagrange { q = { th }, T = m/2*der(swing).T*der(swing), V = m*g*swing[2] },
    "m l² θ″ = m l (A ω² cos(θ) cos(ω t) - g sin(θ))")
  has(lagrange { q = { x, x2, x3 }, T = (m1*x.dot^2 + m2*x2.dot^2 + m3*x3.dot^2)/2, V = 0,
    C = { x - x2, x2 - x3 }, Q = { f, 0, 0 } }:reduce "ode", "x″ = f/(m₁ + m₂ + m₃)")
  has(lagrange { q = { x, y1, x2, y2 }, T = m/2*(x.dot^2 + y1.dot^2 + x2.dot^2 + y2.dot^2), V = m*g*(y1 + y2),
    C = { y1, ((x2 - x)^2 + (y2 - y1)^2 - l^2)/2 } }:reduce "ode", "y₁″ = 0")
end)
