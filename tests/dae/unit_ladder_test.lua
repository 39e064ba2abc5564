-- The same model in metres, micrometres, nanometres …: the same index, degrees of freedom, start, result and
-- refusals. Results are compared in units of the model.

--- Unknowns and equations of a model; sizes are those of the unknowns in its units.
local function new_model()
  local m = { y = {}, size = {}, fix = {}, guess = {}, equations = {} }
  function m.unknown(name, size, value, fixed)
    local y = var(name)
    m.y[#m.y + 1], m.size[#m.size + 1] = y, size
    m[fixed and "fix" or "guess"][y] = value*size
    return y
  end
  function m.add(equation) m.equations[#m.equations + 1] = equation end
  function m.mass(n, L, T, x0, y0, x_is_free, y_is_free)
    local x, y = m.unknown("x" .. n, L, x0, x_is_free), m.unknown("y" .. n, L, y0, y_is_free)
    local u, v = m.unknown("u" .. n, L/T, 0, x_is_free), m.unknown("v" .. n, L/T, 0, y_is_free)
    m.add(der(x) ~ u)
    m.add(der(y) ~ v)
    return x, y, u, v
  end
  return m
end

local ladder = {}

--- A rod with a second mass on a spring.
function ladder.rod_and_spring(L, T)
  local m = new_model()
  local g, k = 9.81*L/T^2, 30/T^2
  local x1, y1, u1, v1 = m.mass(1, L, T, 0.6, -0.8, true, false)
  local x2, y2, u2, v2 = m.mass(2, L, T, 1.3, -1.5, true, true)
  local lambda = m.unknown("lambda", 1/T^2, 5)
  local d = sqrt((x2 - x1)^2 + (y2 - y1)^2)
  local f = k*(d - 0.9*L)/d
  m.add(der(u1) ~ -2*lambda*x1 + f*(x2 - x1))
  m.add(der(v1) ~ -2*lambda*y1 + f*(y2 - y1) - g)
  m.add(der(u2) ~ -f*(x2 - x1))
  m.add(der(v2) ~ -f*(y2 - y1) - g)
  m.add(x1^2 + y1^2 ~ L^2)
  return m
end

--- A fast equilibrium; the equations leave the amounts open, only their ratios are told.
function ladder.mixture(C, T)
  local m = new_model()
  local A, B, S = m.unknown("A", C, 1, true), m.unknown("B", C, 0.5), m.unknown("S", C, 0.2, true)
  local r = m.unknown("r", C/T, 0.1)
  m.add(der(A) ~ -r)
  m.add(der(S) ~ r - 0.4*S/T)
  m.add(B*S ~ 0.15*A*C)
  m.add(r ~ 2*A*B/(C*T) - 0.5*S/T)
  return m
end

--- Tanks at one level, in nanometres with coefficients of 10⁻²⁷ beside a function of time.
function ladder.tanks(L, T)
  local m = new_model()
  local h1, h2 = m.unknown("h1", L, 1.5, true), m.unknown("h2", L, 1.5)
  local q = m.unknown("q", L^3/T, 0.1)
  m.add(L^2*der(h1) ~ -q + 0.2*L^3/T*sin(t/T)^2)
  m.add(2*L^2*der(h2) ~ q - 0.3*L^3/T*sqrt(h2/L))
  m.add(h1 ~ h2)
  return m
end

--- T x₁′ = x₂ …, x₁ = g(t): triangular, with T³ between its corners.
function ladder.chain(L, T)
  local m = new_model()
  local x, y, z = m.unknown("x", L, 1.5), m.unknown("y", L, 1), m.unknown("z", L, 0)
  local q, w = m.unknown("q", L, -0.3), m.unknown("w", L, 1, true)
  m.add(T*der(x) ~ y)
  m.add(T*der(y) ~ z)
  m.add(T*der(z) ~ q)
  m.add(x ~ L*(1.5 + sin(0.7*t/T)))
  m.add(T*der(w) ~ -w + z)
  return m
end

--- A knife edge under a force: neither lengths nor times are told.
function ladder.knife_edge(L, T)
  local m = new_model()
  local x, y, u, v = m.mass("", L, T, 0, 0, true, true)
  m.fix[v], m.fix[u], m.guess[v] = nil, 0.2*L/T, 0
  local angle, w = m.unknown("angle", 1, 0.1, true), m.unknown("w", 1/T, 0.5, true)
  local lambda = m.unknown("lambda", L/T^2, 0)
  m.add(der(angle) ~ w)
  m.add(der(w) ~ 0*w)
  m.add(der(u) ~ 2*L/T^2 + lambda*sin(angle))
  m.add(der(v) ~ -lambda*cos(angle))
  m.add(u*sin(angle) ~ v*cos(angle))
  return m
end

--- A slider-crank past the angle at which the slider's position no longer tells the crank's: the states of a
--- form have to change there.
function ladder.slider_crank(L, T)
  local m = new_model()
  local angle, s = m.unknown("angle", 1, 0.4, true), m.unknown("s", L, 3)
  local w, v = m.unknown("w", 1/T, 1, true), m.unknown("v", L/T, 0)
  local lambda = m.unknown("lambda", 1/T^2, 0)
  m.add(der(angle) ~ w)
  m.add(der(s) ~ v)
  m.add(0.4*L^2*der(w) ~ 2*L^2/T^2*cos(t/T) - 2*lambda*s*L*sin(angle))
  m.add(der(v) ~ -5*(s - 3*L)/T^2 - 2*lambda*(s - L*cos(angle)))
  m.add((s - L*cos(angle))^2 + L^2*sin(angle)^2 ~ 6.25*L^2)
  return m
end

--- A crank drives a second one by rods; the rate of the second is in one equation only.
function ladder.crank_and_rod(L, T)
  local m = new_model()
  local a, b = m.unknown("a", 1, 1.2, true), m.unknown("b", 1, -0.5)
  local w, v = m.unknown("w", 1/T, 3, true), m.unknown("v", 1/T, -0.6)
  local lambda = m.unknown("lambda", L/T^2, 0)
  m.add(der(a) ~ w)
  m.add(der(b) ~ v)
  m.add((0.3 + 0.2*cos(a)^2)*L*der(w) ~ -0.5*L/T^2*sin(a) + 0.2*L*sin(a)*cos(a)*w^2 - lambda*cos(a))
  m.add(0.1*L*der(v) ~ 0.2*L/T^2*cos(b) - 2*lambda*cos(b))
  m.add(L*sin(a) + 2*L*sin(b) ~ 0)
  return m
end

local function words(text) return (tostring(text):gsub("\n.*", ""):gsub("%d[%d%.e+-]*", "#")) end

--- Index, dof, start and results, by names.
local function facts_of(make, L, T)
  local m = make(L, T)
  local sys = dae(m.equations)
  local facts = { index = sys:index(), dof = sys:dof() }
  local start = sys:init { from = 0.2*T, fix = m.fix, guess = m.guess }
  local function in_units(of)
    local values = {}
    for k, y in ipairs(m.y) do values[k] = of(y)/m.size[k] end
    return values
  end
  facts.start = in_units(start)
  for _, form in ipairs { "array", "dummy", "baumgarte" } do
    for _, method in ipairs { "auto", "radau" } do
      local ok, values = pcall(function()
        local low = sys:reduce(form, form == "array" and { at = start } or nil)
        local sol = low:integrate { start = start, from = 0.2*T, to = 0.9*T, rtol = 1e-7, method = method }
        expect(sol.status):equals "finished"
        return in_units(function(y) return sol(y, 0.9*T) end)
      end)
      facts[form .. " by " .. method] = ok and values or words(values)
    end
  end
  return facts
end

local function is_same(a, b)
  if type(a) ~= "table" or type(b) ~= "table" then return a == b end
  for k = 1, #a do
    if not (math.abs(a[k] - b[k]) <= 3e-5*(1 + math.abs(a[k]))) then return false end
  end
  return true
end

for name, make in pairs(ladder) do
  test(name .. " has the same index, start and results in every unit, by all forms", function()
    local usual = facts_of(make, 1, 1)
    for _, unit in ipairs { { 1e-9, 1e-9 }, { 1e-9, 1 }, { 1e-9, 1e-3 }, { 1e3, 1e-9 }, { 1e-3, 1e6 } } do
      local L, T = table.unpack(unit)
      local off = {}
      for what, value in pairs(facts_of(make, L, T)) do
        if not is_same(usual[what], value) then off[#off + 1] = what end
      end
      expect(("%g, %g: %s"):format(L, T, table.concat(off, ", "))):equals(("%g, %g: "):format(L, T))
    end
  end)
end

test("models in a ring have their index in every unit, from directions of the derivative array", function()
  local function ring(L, T)
    local n, equations = 100, {}
    local x, y, z, u = var("x", n), var("y", n), var("z", n), var("u", n)
    for i = 1, n do
      local before = (i - 2) % n + 1
      equations[#equations + 1] = T*(der(x[i]) + der(y[i])) ~ x[i] + z[i]
      equations[#equations + 1] = T*(der(x[i]) + der(y[i])) ~ y[i]^3/L^2 + L*sin(y[before]/L)/10
      equations[#equations + 1] = z[i] + x[i] ~ u[i]
      equations[#equations + 1] = T*der(u[i]) ~ -u[i]
    end
    return dae(equations)
  end
  for _, unit in ipairs { { 1, 1e-6 }, { 1e-9, 1 }, { 1e6, 1e6 } } do
    expect(ring(unit[1], unit[2]):index()):equals(1)
  end
end)
