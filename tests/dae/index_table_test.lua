-- Index, free initial values and the number of conditions of small models; the answers are derived by hand.
local x, y, z, w, u, v = vars "x y z w u v"

local function case(name, index, dof, count, make)
  test(name, function()
    local sys = make()
    expect(sys:index()):equals(index)
    expect(sys:dof()):equals(dof)
    if count then expect(#sys:constraints()):equals(count) end
  end)
end

-- Hessenberg forms: the output of a chain of integrators is prescribed
case("three integrators", 4, 0, 3, function() return dae { der(x) ~ y, der(y) ~ z, der(z) ~ w, 0 ~ x - sin(t) } end)
case("four integrators", 5, 0, 4, function() return dae { der(x) ~ y, der(y) ~ z, der(z) ~ w, der(w) ~ v, 0 ~ x - t^6 } end)
case("nonlinear, two differentiations to the force", 3, 0, 2, function() return dae { der(x) ~ y, der(y) ~ -x*w, 0 ~ x^2 + x - t - 1 } end)
case("two outputs of three states", 2, 1, 2, function()
  return dae { der(x) ~ -x + u, der(y) ~ -y + v, der(z) ~ u + v, 0 ~ x + y - sin(t), 0 ~ x - y*z }
end)

-- structure that lies
case("a chain of hidden differences", 1, 3, 3, function()   -- subtract in pairs: x1 - x2, x3 - x4, x5 - x6 are given
  local a = var("a", 7)
  return dae { der(a[2]) + der(a[3]) + a[1] ~ sin(t), der(a[2]) + der(a[3]) + a[2] ~ cos(t), der(a[4]) + der(a[5]) + a[3] ~ t,
    der(a[4]) + der(a[5]) + a[4] ~ t^2, der(a[6]) + der(a[7]) + a[5] ~ 1, der(a[6]) + der(a[7]) + a[6] ~ t, a[7] ~ exp(-t) }
end)
case("leading derivatives cancel in a sum", 3, 0, 2, function() return dae { -der(x, 2) - y ~ sin(t), der(x, 2) + x + y ~ t } end)
case("a determinant that parameters make 0", 1, 1, 1, function()
  local a, b = params "a=2 b=4"
  return dae { der(x) + a*der(y) ~ x, 2*der(x) + b*der(y) ~ y }
end)
case("sin² + cos² - 1", 1, 1, 1, function() return dae { sin(x)^2*der(y) + cos(x)^2*der(y) - der(y) + z ~ x, der(x) ~ z - y, y ~ t } end)
case("a product and its derivative", 2, 0, 2, function()
  return dae { der(x)*exp(y) + x*exp(y)*der(y) ~ z, x*exp(y) ~ sin(t), z + y ~ x }
end)
case("a time-varying combination", 2, 0, 2, function() return dae { 0 ~ -x + t*y + exp(-t), der(x) - t*der(y) ~ 0 } end)

-- an index that depends on a parameter
case("feedthrough 0", 2, 0, 1, function() return dae { der(x) ~ y, 0 ~ x + param("p", 0)*y } end)
case("feedthrough 1", 1, 1, 0, function() return dae { der(x) ~ y, 0 ~ x + param("p", 0)*y }:with { p = 1 } end)

-- circuits
local e1, e2, i1, i2, i3 = vars "e1 e2 i1 i2 i3"
case("source and capacitors in a loop", 2, 1, 1, function()
  return dae { der(e1) + der(e1 - e2) + e1 + i1 ~ 0, der(e2 - e1) + der(e2) + e2 ~ 0, e1 ~ sin(t) }
end)
case("capacitors in a loop without a source", 0, 2, 0, function()
  return dae { der(e1) + der(e1 - e2) + e1 ~ 0, der(e2 - e1) + der(e2) + e2 ~ 0 }
end)
case("a floating capacitor", 1, 1, 1, function() return dae { der(e1 - e2) + e1 ~ 0, der(e2 - e1) + e2 ~ 0 } end)
case("inductors in series", 2, 1, 1, function() return dae { 2*der(i1) ~ e1 - e2, 3*der(i2) ~ e2, 0 ~ i1 - i2, e1 ~ 1 } end)
case("a differentiator with an ideal amplifier", 2, 0, 1, function() return dae { der(e1) ~ i3, 0 ~ i3 + e2/10, e1 ~ sin(t) } end)
case("a transformer without leakage", 1, 1, 1, function() return dae { der(i1) + 2*der(i2) ~ sin(t) - i1, 2*der(i1) + 4*der(i2) ~ -i2 } end)

-- mechanics
local w1, w2, p1, p2, tau = vars "w1 w2 p1 p2 tau"
case("rigid gears, speeds", 2, 1, 1, function() return dae { 2*der(w1) ~ 1 + tau, 3*der(w2) ~ -2*tau, w1 ~ 2*w2 } end)
case("rigid gears, angles", 3, 2, 2, function()
  return dae { der(p1) ~ w1, der(p2) ~ w2, 2*der(w1) ~ 1 + tau, 3*der(w2) ~ -2*tau, p1 ~ 2*p2 }
end)
case("a bead on a parabola", 3, 2, 2, function()
  return lagrange { q = {x, y}, T = (x.dot^2 + y.dot^2)/2, V = 9.81*y, C = { y - x^2 } }
end)
case("a particle on a circle in space", 3, 2, 4, function()
  return lagrange { q = {x, y, z}, T = (x.dot^2 + y.dot^2 + z.dot^2)/2, V = 9.81*z, C = { (x^2 + y^2 + z^2 - 1)/2, x + z }, multipliers = "lambda" }
end)
case("a crane whose load is led", 3, 0, 4, function()
  return dae { der(x, 2) ~ -w*(x - u), der(y, 2) ~ -w*y + 9.81, 0 ~ (x - u)^2 + y^2 - v^2, 0 ~ x - t, 0 ~ y - 2 }
end)

-- processes
case("two tanks, the second level is given", 3, 0, 2, function()
  return dae { der(x) ~ u - sqrt(x), der(y) ~ sqrt(x) - sqrt(y), 0 ~ y - 1 - t/10 }
end)
case("a flash with constant holdup and purity", 2, 0, 2, function()
  return dae { der(x) ~ 1 - u - v, der(y) ~ (0.5 - y*u - 2*y/(1 + y)*v)/x, 0 ~ x - 10, 0 ~ y - 0.3 }
end)
case("two trays", 2, 2, 2, function()
  local M1, M2, c1, c2, L, V = vars "M1 M2 c1 c2 L V"
  return dae { der(M1) ~ V - L - 0.5, der(M2) ~ L - V, der(c1) ~ (V*c2 - L*c1)/M1, der(c2) ~ L*(c1 - c2)/M2, M1 ~ 3, c2 ~ 0.4 + 0.1*sin(t) }
end)

-- unspecified functions
local f, g, h = func("f", 1), func("g", 1), func("h", 1)
case("g(x, z)", 1, 1, 0, function() return dae.semi_explicit { x = {x}, z = {z}, f = { f(x, z) }, g = { h(x, z) } } end)
case("g(x)", 2, 0, 1, function() return dae.semi_explicit { x = {x}, z = {z}, f = { f(x, z) }, g = { g(x) } } end)
case("g(x) and one integrator more", 3, 0, 2, function()
  return dae.semi_explicit { x = {x, y}, z = {z}, f = { f(x, y), h(x, y, z) }, g = { g(x) } }
end)
