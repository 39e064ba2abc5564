-- Sweeps in files: what load gives back, what the fingerprint tells apart.
x, v = vars "x v"
k, m = params "k=1 m=1"
r = input "r"
decay = dae { der(x) ~ -k*x }
driven = dae { der(x) ~ v, m*der(v) ~ -k*x + r }

-- In memory where the system has a folder for that: every store waits for the disk several times, and the
-- disk of a busy machine takes half a second each time.
local function temporary()
  local name = os.tmpname()
  os.remove(name)
  local in_memory = "/dev/shm/" .. name:match "[^/]*$" .. ".db"
  local file = io.open(in_memory, "w")
  if not file then return name .. ".db" end
  file:close()
  os.remove(in_memory)
  return in_memory
end

local function remove(name)
  for _, tail in ipairs { "", "-wal", "-shm" } do os.remove(name .. tail) end
end

-- Makes a sweep with a store and without, and loads it: three times the same numbers.
local function same(sys, options, e)
  local name = temporary()
  local plain = sweep(sys, options)
  options.store = name
  local stored = sweep(sys, options)
  local loaded = load(name)
  expect(stored:final(e)):equals(plain:final(e))
  expect(loaded:final(e)):equals(plain:final(e))
  for _, axis in ipairs(plain.names) do expect(loaded.params[axis]):equals(plain.params[axis]) end
  expect(loaded[1](e, 0.5)):near(plain[1](e, 0.5), 1e-12)
  expect(loaded:mean(e)):near(plain:mean(e), 1e-12)
  expect(store_info(name).done):equals(#plain)
  stored, loaded = nil, nil
  remove(name)
  return name
end

test("load gives back what sweep made", function()
  local joint = normal({ 1, 2 }, { { 0.04, 0.01 }, { 0.01, 0.09 } })
  same(decay, { start = { x = { 1, 2, 3 } }, to = 1, params = { k = { 1, 2, 3 } }, times = { 0, 0.5, 1 } }, x)
  same(decay, { start = { x = normal(1, 0.1) }, to = 1, params = { k = uniform(1, 2) }, runs = 50, seed = 2 },
    x^2)
  same(driven, { start = { x = 1, v = 0 }, to = 1, params = { k = joint[1], m = joint[2] }, runs = 20,
    design = "sobol", inputs = { [r] = function(time) return sin(3*time) end } }, x + v)
  same(driven, { start = driven:init { fix = { x = 1, v = 0 }, inputs = { r = 1 } }, to = 1, runs = 20,
    params = { k = lognormal(0, 0.1), m = beta(2, 3, 1, 2) }, inputs = { r = sin(t) }, method = rk.gauss(2),
    dt = 0.05 }, x)
  same(decay, { start = { x = 1 }, to = 1, params = { k = discrete({ 1, 2 }, { 1, 3 }) }, runs = 20,
    events = { { when = x - 0.5, action = "stop" } } }, x)
end)

test("a run that an event stops before the first wanted time has an end", function()
  local s = sweep(decay, { start = { x = 1 }, to = 1, times = { 1 }, params = { k = { 1, 2 } },
    events = { { when = x - 0.5, action = "stop" } } })
  expect(#s.failures):equals(0)
  expect(s:final(x)):near({ 0.5, 0.5 }, 1e-5)
end)

test("estimates of a fit", function()
  local y = {}
  for i = 1, 41 do y[i] = 2*math.exp(-0.05*(i - 1)) + 0.01*math.sin(37*i) end
  local estimate = fit(decay, { params = { k, x }, data = iddata { y = y, Ts = 0.1 }, y = x })
  same(decay, { start = {}, to = 1, runs = 30, params = { estimate } }, x)
end)

test("what makes another sweep, and what does not", function()
  local name = temporary()
  local function make(change, sys)
    local options = { start = { x = 1 }, to = 1, params = { k = uniform(1, 2) }, runs = 10, seed = 1,
      store = name }
    for key, value in pairs(change) do options[key] = value end
    return sweep(sys or decay, options)
  end
  make {}
  for _, change in ipairs { { workers = 1 }, { limit = 100 }, { retry = true } } do
    expect(#make(change)):equals(10)
  end
  for _, change in ipairs { { seed = 2 }, { to = 2 }, { runs = 11 }, { rtol = 1e-9 },
    { start = { x = 1.0000001 } },
    { params = { k = uniform(1, 2.0000001) } }, { design = "sobol" }, { lanes = 1 },
    { times = { 1 } },
    { events = { { when = x - 0.5, call = function() end } } } } do
    expect(function() make(change) end):fails "holds another sweep"
  end
  expect(function() make({}, dae { der(x) ~ -k*x*1.0001 }) end):fails "holds another sweep"
  local a = 1
  local events = { { when = x - 0.5, call = function() a = a + 0 end } }
  remove(name)
  make { events = events }
  make { events = events }
  expect(function() a = 2 make { events = events } end):fails "holds another sweep"
  remove(name)
end)

test("functions of the script that cannot be written down", function()
  local name = temporary()
  local options = { start = { x = 1, v = 0 }, to = 1, params = { k = { 1, 2 } }, store = name,
    inputs = { r = function(time) return math.floor(2*time) end } }
  local first = sweep(driven, options):final(x)
  expect(function() load(name) end):fails "does not hold inputs.r"
  expect(sweep(driven, options):final(x)):equals(first)
  remove(name)
end)

test("a run that takes too long costs itself", function()
  local hang = { { when = x - 0.5, direction = -1, call = function(sol)
    if sol(k)[1] > 1.9 and sol(k)[1] < 2.1 then while true do local _ = 1 end end
  end } }
  for _, workers in ipairs { 1, 2 } do
    local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = { 1, 2, 3, 4 } }, events = hang,
      limit = 0.3, workers = workers })
    expect(#s.failures):equals(1)
    expect(s.failures[1].index):equals(2)
    expect(s.failures[1].why):equals "it took longer than limit = 0.3 seconds"
    expect(s:final(x)[3]):near(math.exp(-3), 1e-5)
  end
  local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = linspace(1, 2, 40) }, limit = 10 })
  expect(#s.failures):equals(0)                            -- on lanes
end)

test("what is wrong is named", function()
  local function try(change)
    local options = { start = { x = 1 }, to = 1, params = { k = { 1, 2 } } }
    for key, value in pairs(change) do options[key] = value end
    return function() sweep(decay, options) end
  end
  expect(try { store = 3 }):fails "store must be the name of a file"
  expect(try { open = true }):fails "store"
  expect(try { limit = -1 }):fails "limit = -1"
  expect(try { store = "/nowhere/at/all.db" }):fails "no such file or folder"
  expect(function() load "/nowhere/at/all.db" end):fails "no such file or folder"
end)
