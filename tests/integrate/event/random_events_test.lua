--- Events with known times along solutions in closed form: narrow dips and bumps, factors close to each
--- other, kinks, of states, of t, of x′ and z. A condition comes to 0 and back inside one step.
local x, v, w, u, z, n = vars "x v w u z n"
local random = math.random
local function between(a, b) return a + (b - a)*random() end
local function pick(list) return list[random(#list)] end

local function hyperbolic(s)
  local e = math.exp(-2*math.abs(s))
  return (s < 0 and -1 or 1)*(1 - e)/(1 + e)
end
local numbers = { exp = math.exp, abs = math.abs, sqrt = math.sqrt, min = math.min, tanh = hyperbolic }
local symbols = { exp = exp, abs = abs, sqrt = sqrt, min = min, tanh = tanh }

--- Signals by name: a symbol, or x′, and its function of t.
local models = {}
function models.oscillators()
  local k, p, q = between(1.3, 4.5), between(0, 6.28), between(0, 6.28)
  local function fast(s) return -k^2*math.sin(k*s + p) end
  return { der(x) ~ v, der(v) ~ -x, der(w) ~ u, der(u) ~ -k^2*w }, {
    { x, function(s) return math.sin(s + q) end }, { v, function(s) return math.cos(s + q) end },
    { w, function(s) return math.sin(k*s + p) end }, { u, function(s) return k*math.cos(k*s + p) end },
    { der(u), fast, k^2 } }
end
function models.growth()
  local a, b = between(0.1, 1), between(4, 30)
  return { der(x) ~ x*(1 - x), der(v) ~ -a*v }, {
    { x, function(s) return 1/(1 + b*math.exp(-s)) end },
    { v, function(s) return 2*math.exp(-a*s) end } }
end
function models.turning()                                  -- x′ = 1 + a sin x by tan(x/2)
  local a, root = 0.3, math.sqrt(1 - 0.3^2)
  return { der(x) ~ 1 + a*sin(x) }, { { x, function(s)
    local angle = root*s/2 + math.atan(a/root)
    return 2*math.atan(root*math.tan(angle) - a) + 2*math.pi*math.floor((angle + math.pi/2)/math.pi)
  end } }
end
function models.algebraic()
  local q = between(0, 6.28)
  local function first(s) return math.sin(s + q) end
  local function second(s) return math.cos(s + q) end
  return { der(x) ~ v, der(v) ~ -x, 0 ~ z - x - v^2/2 }, { { x, first }, { v, second },
    { z, function(s) return first(s) + second(s)^2/2 end, 1 } }
end

--- Shapes of conditions in a signal y that takes the value a, with a width and a level; beside: another one.
local shapes = {
  function(f, y, a, width, level) return level - f.exp(-((y - a)/width)^2) end,
  function(f, y, a, width, level, beside)
    return 1.5 + beside/20 - (1.7 + level)*f.exp(-((y - a)/width)^2)
  end,
  function(f, y, a, width, level) return level - 1/(1 + ((y - a)/width)^2) end,
  function(f, y, a, width, level) return 2*width*(y - a)/(width^2 + (y - a)^2) - level end,
  function(f, y, a, width, level)
    return level*0.7 - (f.tanh((y - a)/width + 2) - f.tanh((y - a)/width - 2))/2
  end,
  function(f, y, a, width) return (y - a)*(y - a - width) end,
  function(f, y, a, width) return f.abs(y - a) - width end,
  function(f, y, a, width, level) return f.sqrt((y - a)^2 + (level*width)^2) - width end,
  function(f, y, a, width, level) return f.min(y - a + width, a + level*width - y) end,
}

local to, samples = 12, 1300
--- Where g changes its sign: samples, the extrema between them, bisection.
local function roots_of(g)
  local list, dt = {}, to/samples
  local function bisect(a, b)
    local rising = g(a) < 0
    for _ = 1, 50 do
      local middle = (a + b)/2
      if (g(middle) < 0) == rising then a = middle else b = middle end
    end
    list[#list + 1] = { t = a, rising = rising }
  end
  local before, now = g(0), g(dt)
  if before*now < 0 then bisect(0, dt) end
  for i = 2, samples do
    local next = g(i*dt)
    if now*next < 0 then bisect((i - 1)*dt, i*dt) end
    local side = now < 0 and -1 or 1
    if before*now > 0 and now*next > 0 and side*now <= side*before and side*now <= side*next then
      local a, b = (i - 2)*dt, i*dt
      for _ = 1, 60 do
        local p, q = a + 0.382*(b - a), b - 0.382*(b - a)
        if side*g(p) < side*g(q) then b = q else a = p end
      end
      if side*g(a) < 0 then bisect((i - 2)*dt, a) bisect(a, i*dt) end
    end
    before, now = now, next
  end
  return list
end

local function wanted(roots, direction)
  local list = {}
  for _, root in ipairs(roots) do
    if direction == 0 or root.rising == (direction > 0) then list[#list + 1] = root.t end
  end
  return list
end

--- A condition as an expression, and its roots; nil where they depend on errors of the solution.
local function condition(signals, error)
  local signal, other = pick(signals), pick(signals)
  if random() < 0.1 then signal = { t, function(s) return s end } end
  local shape, a, level = pick(shapes), signal[2](between(0.1, 0.9)*to), between(0.1, 0.9)
  local low, high = math.huge, -math.huge
  for i = 0, 100 do
    local y = signal[2](to*i/100)
    low, high = math.min(low, y), math.max(high, y)
  end
  local width = 10^between(-2.3, -0.5)*math.min(high - low, 10)
  local function shifted(by)
    return roots_of(function(s) return shape(numbers, signal[2](s) + by, a, width, level, other[2](s)) end)
  end
  local roots, shift = shifted(0), error*(signal[3] or 1)
  if #shifted(shift) ~= #roots or #shifted(-shift) ~= #roots then return end
  for k, root in ipairs(roots) do
    local next = roots[k + 1] and roots[k + 1].t or to
    if root.t < 1e-2 or next - root.t < 1e-3 then return end
  end
  return shape(symbols, signal[1], a, width, level, other[1]), roots
end

local function times(list)
  local texts = {}
  for k, at in ipairs(list) do texts[k] = ("%.4f"):format(at) end
  return table.concat(texts, " ")
end

local methods = { "auto", "dopri5", "tsit5", "dop853", "verner87", "verner98", "radau", "bdf", "rodas5p",
  "gauss" }
local names = { "oscillators", "oscillators", "growth", "turning", "algebraic" }

--- What is wrong in a run with some of them, as events that count or that change nothing.
local function wrong_events(seed)
  math.randomseed(seed)
  local equations, signals = models[pick(names)]()
  local method, rtol = pick(methods), 10^between(-9, -5)
  local start, events, expected = { [n] = 0 }, {}, {}
  for _, signal in ipairs(signals) do
    if not signal[3] then start[signal[1]] = signal[2](0) end
  end
  equations[#equations + 1] = der(n) ~ 0
  local counted = 0
  for _ = 1, pick { 1, 1, 2 } do
    local when, roots = condition(signals, 1e4*rtol)
    if when then
      local direction, counts = pick { 0, 0, 1, -1 }, random() < 0.3
      expected[#expected + 1] = wanted(roots, direction)
      if counts then counted = counted + #expected[#expected] end
      local reset = counts and { [n] = n + 1 } or nil
      events[#events + 1] = { when = when, direction = direction, reset = reset }
    end
  end
  if #events == 0 then return end
  local sol = dae(equations):integrate { start = start, to = to, method = method, rtol = rtol,
    events = events }
  local found, complaints = {}, {}
  for i in ipairs(events) do found[i] = {} end
  for _, event in ipairs(sol.events) do table.insert(found[event.which], event.t) end
  for i, event in ipairs(events) do
    local right = #found[i] == #expected[i]
    for k, at in ipairs(expected[i]) do right = right and math.abs(found[i][k] - at) < 1e-2 end
    if not right then
      complaints[#complaints + 1] = ("seed %d, %s, rtol %.1e, %s: %s, not %s"):format(seed, method, rtol,
        tostring(event.when), times(found[i]), times(expected[i]))
    end
  end
  if sol:final(n) ~= counted then
    complaints[#complaints + 1] = ("seed %d: %g resets"):format(seed, sol:final(n))
  end
  return complaints[1] and table.concat(complaints, "\n"), #events
end

test("narrow events of random shapes are found where they are", function()
  local wrong, count = {}, 0
  for seed = 1, 290 do
    local complaint, events = wrong_events(seed)
    count = count + (events or 0)
    wrong[#wrong + 1] = complaint
  end
  expect(count > 250):is_true()
  expect(table.concat(wrong, "\n")):equals ""
end)
