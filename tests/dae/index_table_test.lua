-- Index, free initial values and the number of conditions of small models; the answers are derived by hand.
-- Then every reduced form of them, and of problems.list(), from one start: all go the same way, or say why
-- there is no such form.
--
-- Every form is integrated at two tolerances. A method that errs by less than atol + rtol |x| per step errs
-- in the end by a multiple of it that the problem decides; the difference between the two runs of one form
-- measures it. With `spread` the largest of these differences over all forms, the runs at the tighter
-- tolerance agree to a few times spread, and to what rounding allows.
local x, y, z, w, u, v = vars "x y z w u v"

local forms = { "", "acc", "ggl", "baumgarte", "project", "dummy", "minimal", "ode" }
local tight = 1e-9
local function floor(rtol) return 50*rtol end              -- some fifty steps, each of which may err by rtol

local function integrate(low, start, to, inputs, tolerance)
  local direct = low:index() >= 2 or nil
  return low:integrate { start = start, to = to, inputs = inputs, rtol = tolerance, atol = tolerance,
    direct = direct,
    method = direct and "radau" or nil, guards = false }
end

local function difference(a, b, states)
  local worst, where = 0, nil
  for _, s in ipairs(states) do
    local one, other = a:final(s), b:final(s)
    local e = math.abs(one - other)/math.max(1, math.abs(one))
    if not (e <= worst) then worst, where = e, s end
  end
  return worst, where
end

local function agree(sys, start, to, inputs, exact, rtol)
  rtol = rtol or tight
  local states = sys.differential
  local runs, spread = {}, 0
  local function take(label, low)
    local sol = integrate(low, start, to, inputs, rtol)
    if sol.status ~= "finished" then error(label .. ": " .. sol.status) end
    local rough = integrate(low, start, to, inputs, 30*rtol)
    spread = math.max(spread, (difference(rough, sol, states)))
    runs[#runs + 1] = { label = label, sol = sol }
  end
  local s = sys:structure()
  if sys:index() <= 2 and s.valid and s.structural_index == sys:index() then take("as it is", sys) end
  for _, form in ipairs(forms) do
    local good, low = pcall(function()
      if form == "" then return sys:reduce() end
      return sys:reduce(form, (form == "dummy" or form == "minimal") and { at = start } or nil)
    end)
    if good then
      take(form == "" and "reduce()" or form, low)
    else
      low = tostring(low)
      if not low:find('form "' .. form .. '"', 1, true) or #low < 60 then
        error("a refusal that says little: " .. low) end
    end
  end
  local bound = 5*spread + floor(rtol)
  for i = 2, #runs do
    local e, where = difference(runs[1].sol, runs[i].sol, states)
    if not (e <= bound) then
      error(("%s and %s differ by %.1e in %s, the bound is %.1e"):format(runs[1].label, runs[i].label, e,
        tostring(where), bound))
    end
  end
  for symbol, value in pairs(exact or {}) do
    local e = math.abs(runs[1].sol:final(symbol) - evaluate(value, { t = to }))
    if not (e <= bound*math.max(1, math.abs(evaluate(value, { t = to })))) then
      error(("%s is off by %.1e from the exact solution"):format(tostring(symbol), e))
    end
  end
  expect(#runs >= 2):is_true()
end

--- start: guesses for the values that are free; to: the end (0.5); without start the forms are not
-- integrated.
local function case(name, index, dof, count, make, start, to)
  test(name, function()
    local sys = make()
    expect(sys:index()):equals(index)
    expect(sys:dof()):equals(dof)
    if count then expect(#sys:constraints()):equals(count) end
  end)
  if start then
    test(name .. ": its forms agree", function()
      local sys = make()
      local guess = {}
      for _, s in ipairs(sys.differential) do guess[s] = 0.1 end
      for _, s in ipairs(sys.algebraic) do guess[s] = 0.1 end
      for name, value in pairs(start) do guess[var(name)] = value end
      agree(sys, sys:init { guess = guess }, to or 0.5)
    end)
  end
end

-- Hessenberg forms: the output of a chain of integrators is prescribed
case("three integrators", 4, 0, 3, function() return dae { der(x) ~ y, der(y) ~ z, der(z) ~ w,
  0 ~ x - sin(t) } end, {})
case("four integrators", 5, 0, 4, function() return dae { der(x) ~ y, der(y) ~ z, der(z) ~ w, der(w) ~ v,
  0 ~ x - t^6 } end, {})
case("nonlinear, two differentiations to the force", 3, 0, 2, function()
  return dae { der(x) ~ y, der(y) ~ -x*w, 0 ~ x^2 + x - t - 1 } end, { x = 0.6 })
case("two outputs of three states", 2, 1, 2, function()
  return dae { der(x) ~ -x + u, der(y) ~ -y + v, der(z) ~ u + v, 0 ~ x + y - sin(t), 0 ~ x - y*z }
end, { y = 0.5, z = 0.5 })

-- structure that lies
-- subtract in pairs: x1 - x2, x3 - x4, x5 - x6 are given
case("a chain of hidden differences", 1, 3, 3, function()
  local a = var("a", 7)
  return dae { der(a[2]) + der(a[3]) + a[1] ~ sin(t), der(a[2]) + der(a[3]) + a[2] ~ cos(t),
    der(a[4]) + der(a[5]) + a[3] ~ t,
    der(a[4]) + der(a[5]) + a[4] ~ t^2, der(a[6]) + der(a[7]) + a[5] ~ 1, der(a[6]) + der(a[7]) + a[6] ~ t,
      a[7] ~ exp(-t) }
end, {})
case("leading derivatives cancel in a sum", 3, 0, 2, function()
  return dae { -der(x, 2) - y ~ sin(t), der(x, 2) + x + y ~ t } end, {})
case("a determinant that parameters make 0", 1, 1, 1, function()
  local a, b = params "a=2 b=4"
  return dae { der(x) + a*der(y) ~ x, 2*der(x) + b*der(y) ~ y }
end, {})
case("sin² + cos² - 1", 1, 1, 1, function() return dae { sin(x)^2*der(y) + cos(x)^2*der(y) - der(y) + z ~ x,
  der(x) ~ z - y, y ~ t } end, {})
case("a product and its derivative", 2, 0, 2, function()
  return dae { der(x)*exp(y) + x*exp(y)*der(y) ~ z, x*exp(y) ~ sin(t), z + y ~ x }
end, { x = 0, y = -1, z = 1 })
case("a time-varying combination", 2, 0, 2, function()
  return dae { 0 ~ -x + t*y + exp(-t), der(x) - t*der(y) ~ 0 } end, {})

case("a coefficient that is 0 at the start is not divided by", 3, 0, 2, function()
  return dae { x ~ t^3 - der(y), y ~ sin(t) - t*der(z), z ~ exp(t) + t }
end, {})
-- an index that depends on a parameter
case("feedthrough 0", 2, 0, 1, function() return dae { der(x) ~ y, 0 ~ x + param("p", 0)*y } end, {})
case("feedthrough 1", 1, 1, 0, function() return dae { der(x) ~ y,
  0 ~ x + param("p", 0)*y }:with { p = 1 } end, {})

-- circuits
local e1, e2, i1, i2, i3 = vars "e1 e2 i1 i2 i3"
case("source and capacitors in a loop", 2, 1, 1, function()
  return dae { der(e1) + der(e1 - e2) + e1 + i1 ~ 0, der(e2 - e1) + der(e2) + e2 ~ 0, e1 ~ sin(t) }
end, {})
case("capacitors in a loop without a source", 0, 2, 0, function()
  return dae { der(e1) + der(e1 - e2) + e1 ~ 0, der(e2 - e1) + der(e2) + e2 ~ 0 }
end, {})
case("a floating capacitor", 1, 1, 1, function() return dae { der(e1 - e2) + e1 ~ 0,
  der(e2 - e1) + e2 ~ 0 } end, {})
case("inductors in series", 2, 1, 1, function() return dae { 2*der(i1) ~ e1 - e2, 3*der(i2) ~ e2, 0 ~ i1 - i2,
  e1 ~ 1 } end, {})
case("a differentiator with an ideal amplifier", 2, 0, 1, function()
  return dae { der(e1) ~ i3, 0 ~ i3 + e2/10, e1 ~ sin(t) } end, {})
case("a transformer without leakage", 1, 1, 1, function()
  return dae { der(i1) + 2*der(i2) ~ sin(t) - i1, 2*der(i1) + 4*der(i2) ~ -i2 } end, {})

-- mechanics
local w1, w2, p1, p2, tau = vars "w1 w2 p1 p2 tau"
case("rigid gears, speeds", 2, 1, 1, function() return dae { 2*der(w1) ~ 1 + tau, 3*der(w2) ~ -2*tau,
  w1 ~ 2*w2 } end, {})
case("rigid gears, angles", 3, 2, 2, function()
  return dae { der(p1) ~ w1, der(p2) ~ w2, 2*der(w1) ~ 1 + tau, 3*der(w2) ~ -2*tau, p1 ~ 2*p2 }
end, {})
case("a bead on a parabola", 3, 2, 2, function()
  return lagrange { q = {x, y}, T = (x.dot^2 + y.dot^2)/2, V = 9.81*y, C = { y - x^2 } }
end, {})
case("a particle on a circle in space", 3, 2, 4, function()
  return lagrange { q = {x, y, z}, T = (x.dot^2 + y.dot^2 + z.dot^2)/2, V = 9.81*z,
    C = { (x^2 + y^2 + z^2 - 1)/2, x + z }, multipliers = "lambda" }
end, {})
case("a crane whose load is led", 3, 0, 4, function()
  return dae { der(x, 2) ~ -w*(x - u), der(y, 2) ~ -w*y + 9.81, 0 ~ (x - u)^2 + y^2 - v^2, 0 ~ x - t,
    0 ~ y - 2 }
end, {})

-- processes
case("two tanks, the second level is given", 3, 0, 2, function()
  return dae { der(x) ~ u - sqrt(x), der(y) ~ sqrt(x) - sqrt(y), 0 ~ y - 1 - t/10 }
end, {})
case("a flash with constant holdup and purity", 2, 0, 2, function()
  return dae { der(x) ~ 1 - u - v, der(y) ~ (0.5 - y*u - 2*y/(1 + y)*v)/x, 0 ~ x - 10, 0 ~ y - 0.3 }
end, {})
case("two trays", 2, 2, 2, function()
  local M1, M2, c1, c2, L, V = vars "M1 M2 c1 c2 L V"
  return dae { der(M1) ~ V - L - 0.5, der(M2) ~ L - V, der(c1) ~ (V*c2 - L*c1)/M1, der(c2) ~ L*(c1 - c2)/M2,
    M1 ~ 3, c2 ~ 0.4 + 0.1*sin(t) }
-- M2 falls by 0.5 a second, and c2′ is divided by it
end, { M2 = 1 })

-- unspecified functions
local f, g, h = func("f", 1), func("g", 1), func("h", 1)
case("g(x, z)", 1, 1, 0, function() return dae.semi_explicit { x = {x}, z = {z}, f = { f(x, z) },
  g = { h(x, z) } } end)
case("g(x)", 2, 0, 1, function() return dae.semi_explicit { x = {x}, z = {z}, f = { f(x, z) },
  g = { g(x) } } end)
case("g(x) and one integrator more", 3, 0, 2, function()
  return dae.semi_explicit { x = {x, y}, z = {z}, f = { f(x, y), h(x, y, z) }, g = { g(x) } }
end)

-- The reference problems, over an interval so short that nothing chaotic happens; those that need minutes are
-- left out.
local large = { chain = true, diode_ladder = true }
for _, p in ipairs(problems.list()) do
  if p.index and not large[p.name] then
    test(p.name .. ": its forms agree", function()
      local to = p.from + math.min(p.to - p.from, 0.2)
      -- squeezer: its multipliers of "ggl" are rounding of lengths, divided by steps; 1e-9 is below that
      agree(p(), p:start(), to, p.inputs, p.exact, p.name == "squeezer" and 1e-8 or nil)
    end)
  end
end
