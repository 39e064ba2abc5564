-- Models of index 0 … 4 whose solution is chosen first, in random units: closed loops, driven and free;
-- loops of capacitors and cutsets of inductors with controlled sources; Hessenberg chains; parameters at
-- which a factor vanishes. Forces and sources are what the solution needs. 200 of them from seed 7 on, by
-- three methods: pendula tests/dae/known_solutions_test.lua 7 200
local function draws(seed)
  local state = seed*7919 + 17
  local function draw(n)
    state = (state*1103515245 + 12345) % 2147483648
    return state//65536 % n + 1
  end
  for _ = 1, 3 do draw(2) end
  return draw
end

local function one_of(draw, list) return list[draw(#list)] end
local function between(draw, low, high) return low + (high - low)*draw(1000)/1000 end

--- The model being made: its equations, and of every unknown its solution, size and whether it is fixed.
local Case = {}
Case.__index = Case

local function case(draw, index, dof)
  local T, L = 10.0^one_of(draw, { 0, -3, 3, -9, 6 }), 10.0^one_of(draw, { 0, 0, -3, 3, -9, 6 })
  return setmetatable({ index = index, dof = dof, T = T, L = L, y = {}, exact = {}, size = {}, fixed = {},
    equations = {} }, Case)
end

--- An unknown of this size; `fixed` where it is one of the free initial values.
function Case:unknown(name, exact, size, fixed)
  local y = var(name)
  local n = #self.y + 1
  self.y[n], self.exact[n], self.size[n], self.fixed[n] = y, exact, size, fixed or false
  return y
end

function Case:add(equation) self.equations[#self.equations + 1] = equation end

--- A swing of some steps of an angle: its value, and s = t/T.
local function swing(draw, T)
  local s = t/T
  local a, b, c = between(draw, 0.4, 0.9), between(draw, 0.1, 0.3), one_of(draw, { 0, 0.4 })
  return c + a*s + b*sin(a*s), s
end

local family = {}

--- A pendulum whose horizontal position is driven by a torque.
function family.driven_pendulum(draw)
  local m = case(draw, 3, 0)
  local L, T = m.L*between(draw, 1, 2), m.T
  local phi = swing(draw, T)
  local X, Y, g = L*cos(phi), L*sin(phi), one_of(draw, { 0, 2 })*L/T^2
  local ax, ay = diff(X, t, 2), diff(Y, t, 2) + g
  local x, y = m:unknown("x", X, L), m:unknown("y", Y, L)
  local u, v = m:unknown("u", diff(X, t), L/T), m:unknown("v", diff(Y, t), L/T)
  local F = m:unknown("F", (X*ax + Y*ay)/L^2, 1/T^2)
  local M = m:unknown("M", (X*ay - Y*ax)/L^2, 1/T^2)
  m:add(der(x) ~ u)
  m:add(der(y) ~ v)
  m:add(der(u) ~ F*x - M*y)
  m:add(der(v) ~ F*y + M*x - g)
  m:add(x^2 + y^2 ~ L^2)
  m:add(x ~ L*cos(phi))
  return m
end

--- A pendulum under a force that depends on time.
function family.pendulum(draw)
  local m = case(draw, 3, 2)
  local L, T = m.L*between(draw, 1, 2), m.T
  local phi, s = swing(draw, T)
  local X, Y, tension = L*cos(phi), L*sin(phi), (2 + sin(s))/T^2
  local x, y = m:unknown("x", X, L), m:unknown("y", Y, L, true)
  local u, v = m:unknown("u", diff(X, t), L/T), m:unknown("v", diff(Y, t), L/T, true)
  local F = m:unknown("F", tension, 1/T^2)
  m:add(der(x) ~ u)
  m:add(der(y) ~ v)
  m:add(der(u) ~ -F*x + diff(X, t, 2) + tension*X)
  m:add(der(v) ~ -F*y + diff(Y, t, 2) + tension*Y)
  m:add(x^2 + y^2 ~ L^2)
  return m
end

--- Two cranks and a coupler, four bars in a closed loop.
function family.closed_loop(draw)
  local m = case(draw, 3, 2)
  local R, D, T = m.L*between(draw, 1, 2), m.L*between(draw, 2, 3), m.T
  local angle, s = swing(draw, T)
  local phi = angle + 0.3
  local points = { { R*cos(phi), R*sin(phi) }, { R*cos(phi) + D, R*sin(phi) } }
  local forces, q = { (1 + 0.3*sin(s))/T^2, (2 - cos(s)/2)/T^2, (0.5 + s/4)/T^2 }, {}
  for k, name in ipairs { "a", "b" } do
    q[k] = { m:unknown(name .. "x", points[k][1], R), m:unknown(name .. "y", points[k][2], R) }
  end
  local v, lambda = {}, {}
  for k, name in ipairs { "a", "b" } do
    v[k] = {}
    for i, axis in ipairs { "x", "y" } do
      v[k][i] = m:unknown("v" .. name .. axis, diff(points[k][i], t), R/T, k == 1 and i == 2)
    end
  end
  m.fixed[2] = true
  for k = 1, 3 do lambda[k] = m:unknown("lambda" .. k, forces[k], 1/T^2) end
  local function pull(p, f, k, i)                             -- by its crank and by the coupler
    local own = i == 1 and k == 2 and p[k][i] - D or p[k][i]
    return f[k]*own + f[3]*(p[k][i] - p[3 - k][i])
  end
  for k = 1, 2 do
    for i = 1, 2 do
      m:add(der(q[k][i]) ~ v[k][i])
      m:add(der(v[k][i]) ~ -pull(q, lambda, k, i) + diff(points[k][i], t, 2) + pull(points, forces, k, i))
    end
  end
  m:add(q[1][1]^2 + q[1][2]^2 ~ R^2)
  m:add((q[2][1] - D)^2 + q[2][2]^2 ~ R^2)
  m:add((q[1][1] - q[2][1])^2 + (q[1][2] - q[2][2])^2 ~ D^2)
  return m
end

--- Two capacitors and a source in a loop (or, dual, two inductors and a source at a node), the source
--- controlled by the voltage of one, with an inner resistance r that may be 0: index 2, else 1.
local function pair_of_storages(draw, across, through)
  local inner = one_of(draw, { 0, 0, 0.5 })
  local m = case(draw, inner == 0 and 2 or 1, inner == 0 and 1 or 2)
  local U, T, I = m.L, m.T, 10.0^one_of(draw, { 0, -3, -9 })
  local C1, C2, G = between(draw, 1, 3)*I*T/U, between(draw, 1, 3)*I*T/U, between(draw, 0.2, 1)*I/U
  local k = one_of(draw, { 0, 0.5, -2 })
  local s = t/T
  local second = U*sin(0.8*s + 0.3)
  local first = (C2*second - G*U*T/0.8*cos(0.8*s + 0.3))/C1 + U
  local flow = C1*diff(first, t)
  local a = m:unknown(across .. 1, first, U, inner ~= 0)
  local b = m:unknown(across .. 2, second, U, true)
  local i = m:unknown(through, flow, I)
  local r = param("r", inner*U/I)
  m:add(C1*der(a) ~ i)
  m:add(C2*der(b) ~ i - G*b)
  m:add(a + b + r*i ~ first + second + inner*U/I*flow + k*(b - second))
  return m
end
function family.capacitor_loop(draw) return pair_of_storages(draw, "u", "i") end
function family.inductor_cutset(draw) return pair_of_storages(draw, "i", "u") end

--- x₁′ = x₂ + …, …, x_n′ = z + …, 0 = x₁ - g(t), and a state beside it.
function family.chain(draw)
  local n = draw(3)
  local m = case(draw, n + 1, 1)
  local L, T, s = m.L, m.T, t/m.T
  local shape = draw(3)
  local function beside(e) return ({ 0*e, e^2/(5*L), sin(e/L)*L/4 })[shape] end
  local exact, x = { L*(sin(0.7*s) + 1.5) }, {}
  for k = 1, n do exact[k + 1] = T*diff(exact[k], t) - beside(exact[k]) end
  for k = 1, n do x[k] = m:unknown("x" .. k, exact[k], L) end
  x[n + 1] = m:unknown("z", exact[n + 1], L)
  local w = m:unknown("w", L*exp(-s), L, true)
  for k = 1, n do m:add(T*der(x[k]) ~ x[k + 1] + beside(x[k])) end
  m:add(x[1] ~ exact[1])
  m:add(T*der(w) ~ -w + (x[1] - exact[1])*one_of(draw, { 0, 1 }))
  return m
end

--- ε z′ = x² - z at ε = 0, and (a - b) x″ = … at a = b.
function family.vanishing_factor(draw)
  local m = case(draw, 1, 1)
  local L, T, s = m.L, m.T, t/m.T
  local x = m:unknown("x", L*exp(-s), L, true)
  local z = m:unknown("z", L*exp(-2*s), L)
  local a = param("a", draw(3))
  local b = param("b", a.value or 0)
  m:add(T*der(x) ~ -x)
  m:add((a - b)*T*der(z) ~ x^2/L - z)
  return m
end

--- A velocity on a circle: index 2.
function family.circle(draw)
  local m = case(draw, 2, 1)
  local L, T = m.L, m.T
  local phi, s = swing(draw, T)
  local X, Y, pull = L*cos(phi + 0.3), L*sin(phi + 0.3), (1 + sin(s)/2)/T
  local x, y = m:unknown("x", X, L), m:unknown("y", Y, L, true)
  local F = m:unknown("F", pull, 1/T)
  m:add(der(x) ~ -F*x + diff(X, t) + pull*X)
  m:add(der(y) ~ -F*y + diff(Y, t) + pull*Y)
  m:add(x^2 + y^2 ~ L^2)
  return m
end

--- z + z³ = x beside x′ = …: index 1; without z, index 0.
function family.implicit(draw)
  local has_z = draw(2) == 1
  local m = case(draw, has_z and 1 or 0, 2)
  local L, T, s = m.L, m.T, t/m.T
  local Z = 0.5 + 0.3*sin(s)
  local x = m:unknown("x", L*(Z + Z^3), L, true)
  local y = m:unknown("y", L*cos(s), L, true)
  local z = has_z and m:unknown("z", Z, 1)
  m:add(T*der(x) ~ T*diff(L*(Z + Z^3), t) - (y - L*cos(s)))
  m:add(T*der(y) + x ~ -L*sin(s) + L*(Z + Z^3))
  if has_z then m:add(z + z^3 ~ x/L) end
  return m
end

local names = {}
for name in pairs(family) do names[#names + 1] = name end
table.sort(names)

local function made(seed)
  local name = names[seed % #names + 1]
  local m = family[name](draws(seed))
  m.name, m.sys = name, dae(m.equations)
  function m.at(time)
    local values = {}
    for k = 1, #m.y do values[k] = fn({ t }, m.exact[k])(time) end
    return values
  end
  return m
end

local function first_line(text) return (tostring(text):gsub("\n.*", "")) end

--- "" or what is off by more than `most` of its size.
local function off(m, of, values, most)
  for k = 1, #m.y do
    local error = math.abs(of(m.y[k]) - values[k])/(math.abs(values[k]) + m.size[k])
    if not (error <= most) then return ("%s = %.10g, not %.10g"):format(m.y[k], of(m.y[k]), values[k]) end
  end
  return ""
end

--- Tolerances in the sizes of the unknowns that a form has.
local function tolerances(m, low)
  local has, atol = {}, {}
  for _, list in ipairs { low.differential, low.algebraic } do
    for k = 1, #list do has[tostring(list[k])] = true end
  end
  for k = 1, #m.y do
    if has[tostring(m.y[k])] then atol[m.y[k]] = 1e-8*m.size[k] end
  end
  return atol
end

local forms = { "as it is", "auto", "array", "acc", "ggl", "baumgarte", "project", "dummy", "minimal", "ode" }
local refusals = { "integrated as it stands", "sys:reduce() gives them", "has no differential variable",
  "is not linear in", "no constraint is differentiated twice", "the form is made for two", "has no row",
  "linear or quadratic in none", "is quadratic in", "all its states are independent",
  "do not determine all unknowns", "integration needs index 0 or 1", "is no state" }
local function is_refusal(why)
  for _, words in ipairs(refusals) do if tostring(why):find(words, 1, true) then return true end end
  return false
end

local function form_of(m, form, start)
  if form == "as it is" then return m.sys end
  if form == "auto" then return m.sys:reduce() end
  return m.sys:reduce(form, form == "array" and { at = start } or nil)
end

--- Calls wrong(what, why) for what is not as it has to be.
local function check(m, methods, wrong)
  local function expected(what, wanted, f)
    local ok, found = pcall(f)
    if not ok or found ~= wanted then wrong(what, ("%s, not %s"):format(first_line(found), wanted)) end
  end
  expected("index", m.index, function() return m.sys:index() end)
  expected("dof", m.dof, function() return m.sys:dof() end)
  local from, to = 0.2*m.T, 0.7*m.T
  local values, fix, guess = m.at(from), {}, {}
  for k, y in ipairs(m.y) do
    if m.fixed[k] then fix[y] = values[k] else guess[y] = tonumber(("%.2g"):format(values[k])) end
  end
  local ok, start = pcall(function() return m.sys:init { from = from, fix = fix, guess = guess } end)
  if not ok then return wrong("start", first_line(start)) end
  local why = off(m, start, values, 1e-9)
  if why ~= "" then return wrong("start", why) end
  if start.free ~= m.dof then wrong("start", ("%d free values, not %d"):format(start.free, m.dof)) end
  local last = m.at(to)
  for _, form in ipairs(forms) do
    local has, low = pcall(form_of, m, form, start)
    if not has and not is_refusal(low) then wrong("reduce " .. form, first_line(low)) end
    for _, method in ipairs(has and methods or {}) do
      local ran, sol = pcall(function()
        return low:integrate { start = start, from = from, to = to, rtol = 1e-7, atol = tolerances(m, low),
          method = method ~= "auto" and method or nil }
      end)
      local how = form .. " by " .. method
      if not ran then
        if not is_refusal(sol) then wrong(how, first_line(sol)) end
      elseif sol.status ~= "finished" then
        wrong(how, first_line(sol))
      else
        why = off(m, function(y) return sol(y, to) end, last, 1e-4)
        if why ~= "" then wrong(how, why) end
      end
    end
  end
end

--- Models seed … seed + number - 1; how many things were wrong.
local function campaign(seed, number)
  local count = 0
  for k = seed, seed + number - 1 do
    local m = made(k)
    check(m, { "auto", "radau", "bdf" }, function(what, why)
      count = count + 1
      print(("%d %s, T = %g, L = %g: %s: %s"):format(k, m.name, m.T, m.L, what, why))
    end)
  end
  print(("%d models, %d wrong"):format(number, count))
  return count
end

if arg and tonumber(arg[1]) then os.exit(campaign(tonumber(arg[1]), tonumber(arg[2] or 200)) == 0) end

test("a state whose factor vanishes is named with its parameter and the form that runs", function()
  local x, z, w = vars "x z w"
  local eps = param("eps", 0)
  for _, sys in ipairs {
    dae { der(x) ~ -x, eps*der(z) ~ x^2 - z }, dae { der(x) ~ -x, eps*der(z) ~ x^2 - z, w ~ x + z },
    dae { der(x) ~ -x, (eps - 3)*eps*der(z) + z ~ x }
  } do
    expect(function() sys:integrate { start = { x = 1 }, to = 1 } end):fails "with eps = 0 the equation (2)"
    expect(sys:reduce():integrate { start = { x = 1 }, to = 1 }.status):equals "finished"
    local other = sys:with { eps = 1 }
    expect(other:integrate { start = { x = 1, z = 1 }, to = 1 }.status):equals "finished"
  end
end)

test("index, degrees of freedom, starts and runs of all forms are those of the chosen solution", function()
  for seed = 1, #names do
    local m, wrong = made(seed), {}
    check(m, { "auto" }, function(what, why) wrong[#wrong + 1] = what .. ": " .. why end)
    expect(m.name .. ": " .. table.concat(wrong, "; ")):equals(m.name .. ": ")
  end
end)
