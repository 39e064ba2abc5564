-- Stops and dry friction along one line: what a stop holds rests, and its friction has no side.
local x, v, N = vars "x v N"
local methods = { "auto", "radau", "dopri5", "bdf", "rodas" }

-- F = t - 2 in units L, S: pressed to the stop until 2, held by friction until 3, then x = (t - 3)³/6.
test("a body that a stop holds leaves it when the force exceeds its friction, in any order of the equations", function()
  for _, units in ipairs { { 1, 1 }, { 1e-7, 1e-6 }, { 1e3, 1e4 } } do
    local L, S = units[1], units[2]
    local equations = { der(x) ~ v, S^2*der(v) ~ L*(t/S - 2) - L*sign(v) + N, 0 ~ min(x, N) }
    for _, order in ipairs { { 1, 2, 3 }, { 3, 1, 2 }, { 2, 3, 1 } } do
      local list = {}
      for k, which in ipairs(order) do list[k] = equations[which] end
      local sys = dae(list)
      local start = sys:init { fix = { x = 0, v = 0 } }
      expect(start(N)/L):near(2, 1e-8)
      for _, method in ipairs(methods) do
        local sol = sys:integrate { start = start, to = 5*S, method = method }
        expect(method .. " " .. sol.status):equals(method .. " finished")
        expect(sol(N, S)/L):near(1, 1e-6)
        expect(sol(N, 2.5*S)):equals(0)
        expect(sol(x, 2.9*S)/L):near(0, 1e-9)
        expect(sol(x, 5*S)/L):near(4/3, 1e-4)
      end
    end
  end
end)

test("where a constraint holds a body for good, its friction is 0 as well", function()
  for _, list in ipairs { { der(x) ~ v, der(v) ~ sin(t) - 3*x - sign(v) + N, 0 ~ x - 0.2 },
    { 0 ~ x - 0.2, der(x) ~ v, der(v) ~ sin(t) - 3*x - sign(v) + N } } do
    expect(dae(list):init { from = 1 }(N)):near(0.6 - math.sin(1), 1e-9)
  end
end)

test("derivatives at a start are right where the coefficients of an equation are 10⁻¹⁴", function()
  for _, S in ipairs { 1, 1e-3, 1e-6, 1e-7, 1e-9, 1e6 } do
    local sys = dae { 0 ~ N, der(x) ~ v, 2*S^2*der(v) ~ 3e-7*sin(t/S) - x - 0.01*S*v + N }
    local start = sys:init { from = 4*S, fix = { x = 3e-7*math.sin(4), v = 0 } }
    for _, e in ipairs { v.dot.dot, x.dot.dot.dot } do expect(start(e)*S^3/3e-7):near(math.cos(4)/2, 1e-9) end
  end
end)

-- Random chains of masses with springs, plastic stops, contacts between neighbours and dry friction, beside
-- Moreau's time stepping (impulses by projected Gauss-Seidel), whose error falls with its step.
local function chain(seed)
  math.randomseed(seed)
  local r = math.random
  local M = { n = r(4), mass = {}, k = {}, c = {}, f = {}, w = {}, x = {}, v = {}, stop = {}, friction = {},
    near = {}, between = {} }
  for i = 1, M.n do
    M.mass[i], M.k[i], M.c[i], M.f[i], M.w[i] = 0.5 + 2*r(), 1 + 7*r(), 0.3*r(), 3*r(), 0.5 + 2*r()
    M.stop[i] = r() < 0.6 and i - 1.05 - 0.4*r()
    M.friction[i] = r() < 0.6 and 0.2 + 1.5*r() or 0
    M.x[i] = math.max(r() + i - 1.3, (M.stop[i] or -9) + 0.1, (M.x[i - 1] or -9) + 0.2)
    M.v[i] = 2*r() - 1
    M.near[i], M.between[i] = r() < 0.5, 4*r()
  end
  M.near[M.n] = false
  return M
end

local function force(M, i, s, x, v, sine)
  local F = M.f[i]*sine(M.w[i]*s) - M.k[i]*(x[i] - (i - 1)) - M.c[i]*v[i]
  if i > 1 then F = F - M.between[i - 1]*(x[i] - x[i - 1] - 1) end
  if i < M.n then F = F + M.between[i]*(x[i + 1] - x[i] - 1) end
  return F
end

local function stepped(M, to, h)
  local n, x, v = M.n, { table.unpack(M.x) }, { table.unpack(M.v) }
  for step = 1, math.floor(to/h + 0.5) do
    local middle, u, at_stop, rubbing, pair = {}, {}, {}, {}, {}
    for i = 1, n do middle[i] = x[i] + h/2*v[i] end
    for i = 1, n do
      u[i] = v[i] + h*force(M, i, (step - 0.5)*h, middle, v, math.sin)/M.mass[i]
      at_stop[i], rubbing[i], pair[i] = 0, 0, 0
    end
    local change = 1
    while change > 1e-12 do
      change = 0
      local function add(i, impulse)
        u[i] = u[i] + impulse/M.mass[i]
        change = math.max(change, math.abs(impulse))
      end
      for i = 1, n do
        local before = at_stop[i]
        if M.stop[i] and middle[i] <= M.stop[i] then at_stop[i] = math.max(0, before - M.mass[i]*u[i]) end
        add(i, at_stop[i] - before)
        before = pair[i]
        if M.near[i] and middle[i + 1] - middle[i] <= 0.1 then
          local mass = 1/(1/M.mass[i] + 1/M.mass[i + 1])
          pair[i] = math.max(0, before - mass*(u[i + 1] - u[i]))
          add(i, before - pair[i])
          add(i + 1, pair[i] - before)
        end
        local most = h*M.friction[i]
        before = rubbing[i]
        rubbing[i] = math.max(-most, math.min(most, before - M.mass[i]*u[i]))
        add(i, rubbing[i] - before)
      end
    end
    for i = 1, n do x[i], v[i] = middle[i] + h/2*u[i], u[i] end
  end
  return x
end

local function model(M)
  local X, V, P, Q = var("X", M.n), var("V", M.n), var("P", M.n), var("Q", M.n)
  local list, fix = {}, {}
  for i = 1, M.n do
    local F = force(M, i, t, X, V, sin) - M.friction[i]*sign(V[i])
    if M.stop[i] then F, list[#list + 1] = F + P[i], 0 ~ min(X[i] - M.stop[i], P[i]) end
    if M.near[i] then F, list[#list + 1] = F - Q[i], 0 ~ min(X[i + 1] - X[i] - 0.1, Q[i]) end
    if i > 1 and M.near[i - 1] then F = F + Q[i - 1] end
    list[#list + 1] = der(X[i]) ~ V[i]
    list[#list + 1] = M.mass[i]*der(V[i]) ~ F
    fix[X[i]], fix[V[i]] = M.x[i], M.v[i]
  end
  return dae(list), fix, X
end

test("random chains with stops, contacts and friction", function()
  for seed = 1, 24 do
    local M = chain(seed)
    local sys, fix, X = model(M)
    local coarse, fine = stepped(M, 5, 2e-3), stepped(M, 5, 1e-3)
    local start = sys:init { fix = fix }
    for _, method in ipairs { "auto", "radau" } do
      local sol = sys:integrate { start = start, to = 5, method = method }
      expect(("%d %s %s"):format(seed, method, sol.status)):equals(("%d %s finished"):format(seed, method))
      for i = 1, M.n do
        expect(math.abs(sol(X[i], 5) - fine[i]) <= 5*math.abs(fine[i] - coarse[i]) + 3e-3):equals(true)
      end
    end
  end
end)
