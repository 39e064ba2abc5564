-- Sweeps divided into shards: the same numbers, whoever makes them.
x = var "x"
k = param("k", 1)
decay = dae { der(x) ~ -k*x }

local function temporary()
  local name = os.tmpname()
  os.remove(name)
  return name .. ".db"
end

test("shards made one after another equal the sweep in one piece", function()
  local file = temporary()
  local options = { start = { x = normal(1, 0.1) }, to = 1, params = { k = lognormal(0, 0.1) }, runs = 101,
    seed = 4,
    times = { 0.5, 1 } }
  local plain = sweep(decay, options)
  options.store, options.shards = file, 7
  local none = sweep(decay, options)
  expect(#none.failures):equals(0)
  expect(tostring(none)):matches ": 0 finished, 101 not made$"
  expect(store_info(file).done):equals(0)
  for number = 7, 1, -1 do
    expect(shards.run(file .. ".d/" .. number)):equals "done"
    expect(shards.run(file .. ".d/" .. number)):equals "done before"
    if number == 4 then
      expect(#shards.collect(file).open):equals(3)
      expect(tostring(attach(file))):matches "finished, %d+ not made"
    end
  end
  local state = shards.collect(file)
  expect(state.done):equals(101)
  expect(#state.open):equals(0)
  expect(shards.collect(file).done):equals(101)
  local s = attach(file)
  expect(s:final(x)):equals(plain:final(x))
  expect(s(x, 0.5)):equals(plain(x, 0.5))
  os.execute("rm -rf '" .. file .. "'*")
end)

test("shards are written for what the store has not", function()
  local file = temporary()
  local options = { start = { x = 1 }, to = 1, params = { k = linspace(1, 2, 10) }, store = file }
  sweep(decay, options)
  options.shards = 3
  expect(#sweep(decay, options)):equals(10)
  expect(#shards.collect(file).open):equals(0)              -- nothing was left to divide
  os.execute("rm -rf '" .. file .. "'*")
end)

test("what is wrong is named", function()
  local file = temporary()
  expect(function() load(file) end):fails(("load: cannot open '%s'"):format(file))
  local function try(change)
    local options = { start = { x = 1 }, to = 1, params = { k = { 1, 2 } } }
    for key, value in pairs(change) do options[key] = value end
    return function() sweep(decay, options) end
  end
  expect(try { shards = 2 }):fails "store"
  expect(try { shards = 0, store = file }):fails "shards must be"
  expect(try { on = {}, store = file }):fails "slurm{"
  expect(try { on = slurm { tasks = 2 } }):fails "store"
  expect(function() slurm { task = 2 } end):fails "Did you mean 'tasks'?"
  expect(function() slurm { tasks = 0 } end):fails "tasks = 0"
  expect(function() slurm { time = 3 } end):fails "option 'time': expected a string, got a number"
  expect(function() shards.run "/nowhere/3" end):fails "there is no '/nowhere/model.lua'"
  expect(try { shards = 2, store = file, events = { { when = x - 0.5, call = function() end } } })
    :fails "cannot be sent to another process"
  os.execute("rm -rf '" .. file .. "'*")
end)
