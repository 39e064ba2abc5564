-- parallel_calls: Lua functions in worker processes; fits from many starts.
x = var "x"
k = param("k", 1)
decay = dae { der(x) ~ -k*x }

test("results do not depend on the workers, random numbers included", function()
  local function draw(i) return { i, rand(), randn() } end
  local one, two = parallel_calls(20, draw, { workers = 1, seed = 3 }),
    parallel_calls(20, draw, { workers = 3, seed = 3 })
  for i = 1, 20 do expect(one[i]):equals(two[i]) end
  expect(one[1][2] ~= one[2][2]):equals(true)
  expect(parallel_calls(2, draw, { seed = 4 })[1][2] ~= one[1][2]):equals(true)
  seed(1)
  local before = rand()
  seed(1)
  parallel_calls(3, draw, { workers = 1 })
  expect(rand()):equals(before)
end)

test("failures cost one call", function()
  local function f(i)
    if i == 2 then error "no such thing" end
    if i == 3 then while true do local _ = i end end
    return i
  end
  for _, workers in ipairs { 1, 2 } do
    local results, failures = parallel_calls(4, f, { workers = workers, limit = 0.3 })
    expect(results[2]):equals(false)
    expect(results[4]):equals(4)
    expect(#failures):equals(2)
    expect(failures[1].why):matches "no such thing"
    expect(failures[2].why):equals "it took longer than limit = 0.3 seconds"
  end
end)

test("a fit from many starts, and its bootstrap", function()
  local y = {}
  for i = 1, 41 do y[i] = 2*math.exp(-0.5*(i - 1)*0.1) + 0.02*math.sin(37*i) end
  local function estimate(data, guess)
    return fit(decay, { params = { k, x }, data = iddata { y = data, Ts = 0.1 }, y = x,
      guess = { k = guess } })
  end
  local fits = parallel_calls(6, function(i)
    local r = estimate(y, 0.2*i)
    return { r.theta[1], r.loss }
  end)
  for i = 1, 6 do expect(fits[i][1]):near(fits[1][1], 1e-5) end
  local r = estimate(y, 1)
  local bootstrap = parallel_calls(20, function()
    local sample = {}
    for i = 1, #y do sample[i] = y[i] + 0.02*randn() end
    return estimate(sample, 1).theta[1]
  end)
  expect(quantile(bootstrap, 0.05) < r.theta[1] and r.theta[1] < quantile(bootstrap, 0.95)):equals(true)
end)

test("what is wrong is named", function()
  expect(function() parallel_calls(0, print) end):fails "n = 0"
  expect(function() parallel_calls(2, 3) end):fails "f"
  local _, failures = parallel_calls(1, function() return "text" end, { workers = 1 })
  expect(failures[1].why):matches "what f returned"
end)
