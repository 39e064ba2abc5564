-- Models of courses on dynamics in the form in which their books print the equations.
local has = require "printed"
local m, M, g, R, l, k, J, a, om, al, B, e, G = params "m M g R l k J a omega alpha B e G"
local m1, m2, m3, m4, m5, l1, l2, I1, I3, J1, J2 = params "m1 m2 m3 m4 m5 l1 l2 I1 I3 J1 J2"
local r, th, phi, psi, x, y, th1, th2, th3 = vars "r theta phi psi x y theta1 theta2 theta3"

test("swinging Atwood's machine", function()
  has(lagrange { q = { r, th }, T = M/2*r.dot^2 + m/2*(r.dot^2 + r^2*th.dot^2), V = M*g*r - m*g*r*cos(th) }
    :reduce "ode", "r″ = (m r θ′² + m g cos(θ) - M g)/(m + M)", "θ″ = -(2 r′ θ′ + g sin(θ))/r")
end)

test("pendulum whose support is moved, and Kapitza's pendulum", function()
  local s = input "s"
  local p, q = vec { l*sin(th), s - l*cos(th) }, vec { l*sin(th), a*cos(om*t) + l*cos(th) }
  has(lagrange { q = { th }, T = m/2*der(p).T*der(p), V = m*g*p[2] }:reduce "ode", "θ″ = -(s″ + g) sin(θ)/l")
  has(lagrange { q = { th }, T = m/2*der(q).T*der(q), V = m*g*q[2] }:reduce "ode",
    "θ″ = (g - a ω² cos(ω t)) sin(θ)/l")
end)

test("beads on a turning rod and on a turning parabola", function()
  local rod = vec { r*cos(om*t)*cos(al), r*sin(om*t)*cos(al), r*sin(al) }
  has(lagrange { q = { r }, T = m/2*der(rod).T*der(rod), V = m*g*rod[3] }:reduce "ode",
    "r″ = ω² r cos(α)² - g sin(α)")
  local bowl = vec { r*cos(om*t), r*sin(om*t), a*r^2 }
  has(lagrange { q = { r }, T = m/2*der(bowl).T*der(bowl), V = m*g*bowl[3] }:reduce "ode",
    "r″ = r (ω² - 4 a² r′² - 2 g a)/(4 a² r² + 1)")
  has(lagrange { q = { r }, T = m/2*(r.dot^2 + r^2*om^2), V = k/2*(r - l)^2 }, "m r″ = m ω² r - k (r - l)")
end)

test("gyroscope in gimbals", function()
  has(lagrange { q = { phi, th, psi }, V = 0,
    T = I1/2*(th.dot^2 + phi.dot^2*sin(th)^2) + I3/2*(psi.dot + phi.dot*cos(th))^2 },
    "I₁ θ″ = φ′ (I₁ φ′ cos(θ) - I₃ (φ′ cos(θ) + ψ′)) sin(θ)", "I₃ φ″ cos(θ) + I₃ ψ″ = I₃ θ′ φ′ sin(θ)")
end)

test("a disc that rolls with a pendulum at its axle, a wedge that slides, a cone", function()
  local p = vec { x + l*sin(th), -l*cos(th) }
  has(lagrange { q = { x, th }, T = 3*M/4*x.dot^2 + m/2*der(p).T*der(p), V = m*g*p[2] }:reduce "ode",
    "x″ = 2 m (l θ′² + g cos(θ)) sin(θ)/(2 m sin(θ)² + 3 M)",
    "θ″ = -(2 m l θ′² cos(θ) + g (2 m + 3 M)) sin(θ)/(l (2 m sin(θ)² + 3 M))")
  has(lagrange { q = { x, y }, V = -m*g*y*sin(al),
    T = M/2*x.dot^2 + m/2*(x.dot^2 + y.dot^2 + 2*x.dot*y.dot*cos(al)) }:reduce "ode",
    "x″ = -m g sin(α) cos(α)/(m sin(α)² + M)", "y″ = g (m + M) sin(α)/(m sin(α)² + M)")
  has(lagrange { q = { r, phi }, T = m/2*(r.dot^2 + r^2*phi.dot^2*sin(al)^2), V = m*g*r*cos(al) }
    :reduce "ode", "r″ = r φ′² sin(α)² - g cos(α)", "φ″ = -2 r′ φ′/r")
end)

test("small oscillations of coupled pendula, a chain between walls", function()
  has(lagrange { q = { th1, th2 }, T = m*l^2/2*(th1.dot^2 + th2.dot^2),
    V = m*g*l/2*(th1^2 + th2^2) + k*l^2/2*(th1 - th2)^2 }, "m l² θ₁″ = -l (m g θ₁ + l k (θ₁ - θ₂))")
  local u1, u2, u3 = vars "u1 u2 u3"
  has(lagrange { q = { u1, u2, u3 }, T = m/2*(u1.dot^2 + u2.dot^2 + u3.dot^2),
    V = k/2*(u1^2 + (u2 - u1)^2 + (u3 - u2)^2 + u3^2) }, "m u₁″ = k (u₂ - 2 u₁)",
    "m u₂″ = k (u₁ - 2 u₂ + u₃)")
end)

test("triple pendulum: angles enter by their differences", function()
  local p1 = vec { l*sin(th1), -l*cos(th1) }
  local p2 = p1 + vec { l*sin(th2), -l*cos(th2) }
  local p3 = p2 + vec { l*sin(th3), -l*cos(th3) }
  has(lagrange { q = { th1, th2, th3 }, V = m*g*(p1[2] + p2[2] + p3[2]),
    T = m/2*(der(p1).T*der(p1) + der(p2).T*der(p2) + der(p3).T*der(p3)) },
    "3 m l² θ₁″ + 2 m l² θ₂″ cos(θ₁ - θ₂) + m l² θ₃″ cos(θ₁ - θ₃) = -m l (2 l θ₂′² sin(θ₁ - θ₂) "
    .. "+ l θ₃′² sin(θ₁ - θ₃) + 3 g sin(θ₁))")
end)

test("charge in a magnetic field, two bodies with their reduced mass", function()
  has(lagrange { q = { x, y }, T = m/2*(x.dot^2 + y.dot^2) + e*B/2*(x*y.dot - y*x.dot), V = 0 },
    "m x″ = B e y′", "m y″ = -B e x′")
  has(lagrange { q = { r, th }, T = m1*m2/(m1 + m2)/2*(r.dot^2 + r^2*th.dot^2), V = -G*m1*m2/r }
    :reduce "ode", "r″ = r θ′² - G (m₁ + m₂)/r²", "θ″ = -2 r′ θ′/r")
end)

test("gears, and five trucks that are coupled: multipliers written out", function()
  local f, tau = input "f", input "tau"
  local gears = lagrange { q = { th1, th2 }, T = J1/2*th1.dot^2 + J2/2*th2.dot^2, V = 0,
    C = { l1*th1 - l2*th2 }, Q = { tau, 0 } } :reduce "ode"
  has(gears, "θ₁″ = l₂² τ/(l₁² J₂ + l₂² J₁)")
  has(gears:trace(), "z = l₁ J₂ τ/(l₁² J₂ + l₂² J₁)")
  local q, T, C, Q = {}, 0, {}, { f, 0, 0, 0, 0 }
  for i, mass in ipairs { m1, m2, m3, m4, m5 } do
    q[i] = var("s" .. i)
    T = T + mass/2*q[i].dot^2
    if i > 1 then C[i - 1] = q[i] - q[i - 1] end
  end
  local train = lagrange { q = q, T = T, V = 0, C = C, Q = Q } :reduce "ode"
  has(train, "s₅″ = f/(m₁ + m₂ + m₃ + m₄ + m₅)")
  has(train:trace(), "(2) is linear in w = z:  A w = b", "z₄ = -m₅ f/(m₁ + m₂ + m₃ + m₄ + m₅)")
end)
