-- sweep: every run is what integrate gives for its parameters; failures are listed and stop nothing.
local x, y, z = vars "x y z"
local k, m = params "k=1 m=1"
local decay = dae { der(x) ~ -k*x }

test("paired parameters: exact values, columns, statistics", function()
  local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = linspace(0, 2, 41) }, rtol = 1e-10,
    atol = 1e-10 })
  expect(#s):equals(41)
  expect(#s.failures):equals(0)
  for i = 1, 41 do
    expect(s.params.k[i]):near((i - 1)/20, 1e-15)
    expect(s:final(x)[i]):near(math.exp(-(i - 1)/20), 1e-9)
  end
  expect(s(x^2 + k, 0.5)[11]):near(math.exp(-0.5) + 0.5, 1e-9)   -- expressions of states and parameters
  expect(s:final("x")[1]):near(1, 1e-12)
  local sum, square = 0, 0
  for i = 1, 41 do sum = sum + s:final(x)[i] end
  for i = 1, 41 do square = square + (s:final(x)[i] - sum/41)^2 end
  expect(s:mean(x)):near(sum/41, 1e-15)
  expect(s:std(x)):near(math.sqrt(square/40), 1e-14)
  expect(s:min(x)):near(math.exp(-2), 1e-9)
  expect(s:max(x)):near(1, 1e-12)
  expect(s:statistics(x, 0).count):equals(41)
  expect(s:statistics(x, 0).std):near(0, 1e-15)
end)

test("without lanes each run equals integrate bit for bit, here and in worker processes", function()
  local theta, l = var "theta", param("l", 1)
  local pendulum = dae { der(theta, 2) ~ -9.81/l*sin(theta) }
  local options = { start = { theta = 2, [theta.dot] = 0 }, to = 3, params = { l = linspace(1, 2, 12) },
    rtol = 1e-8, lanes = 1 }
  local many = sweep(pendulum, options)
  options.workers = 1
  local one = sweep(pendulum, options)
  expect(many:final(theta)):near(one:final(theta), 0)
  expect(many(theta, 1.2345)):near(one(theta, 1.2345), 0)        -- not a saved time: the runs are repeated
  local alone = pendulum:integrate { start = options.start, to = 3, rtol = 1e-8,
    params = { l = many.params.l[7] } }
  expect(many:final(theta)[7]):equals(alone:final(theta))
  expect(many(theta, 1.2345)[7]):equals(alone(theta, 1.2345))
  expect(many[7](theta, 1.2345)):equals(alone(theta, 1.2345))
end)

test("fixed steps and given times", function()
  local s = sweep(decay, { start = { x = 1 }, params = { k = {1, 2, 3} }, method = rk.rk4, dt = 0.1,
    times = { 0.5, 1 } })
  expect(#s.t):equals(2)
  expect(s(x).rows):equals(2)
  expect(s(x).cols):equals(3)
  local alone = decay:integrate { start = { x = 1 }, to = 1, method = rk.rk4, dt = 0.1, params = { k = 2 } }
  expect(s(x)(1, 2)):equals(alone(x, 0.5))
  expect(s(x)(2, 2)):equals(alone:final(x))
  local usual = sweep(decay, { start = { x = 1 }, to = 1, params = { k = {1, 2} }, method = rk.rk4,
    dt = 0.1 })
  expect(#usual.t):equals(11)                                    -- the mesh itself
end)

test("grid: all combinations, the last list fastest", function()
  local s = sweep(dae { m*der(x) ~ -k*x }, { start = { x = 1 }, to = 1, grid = true,
    params = { k = {1, 2}, m = {1, 2, 4} },
                                             rtol = 1e-10, atol = 1e-10 })
  expect(#s):equals(6)
  expect(s.params.k):near({1, 1, 1, 2, 2, 2}, 0)
  expect(s.params.m):near({1, 2, 4, 1, 2, 4}, 0)
  for i = 1, 6 do expect(s:final(x)[i]):near(math.exp(-s.params.k[i]/s.params.m[i]), 1e-9) end
end)

test("starts: lists of initial values, lists of starts", function()
  local s = sweep(decay, { start = { x = {1, 2, 3} }, to = 1, rtol = 1e-10, atol = 1e-10 })
  expect(s:final(x)):near({math.exp(-1), 2*math.exp(-1), 3*math.exp(-1)}, 1e-9)
  expect(s.params.x):near({1, 2, 3}, 0)
  local list = sweep(decay, { start = { { x = 1 }, decay:init { fix = { x = 5 } } }, to = 1, rtol = 1e-10,
    atol = 1e-10 })
  expect(list:final(x)):near({math.exp(-1), 5*math.exp(-1)}, 1e-9)
  local paired = sweep(decay, { start = { x = {1, 2} }, params = { k = {3, 4} }, to = 1, rtol = 1e-10,
    atol = 1e-10 })
  expect(paired:final(x)):near({math.exp(-3), 2*math.exp(-4)}, 1e-9)
end)

test("the start of a DAE is solved anew for every run", function()
  local L = param("L", 1)
  local circle = dae { der(x) ~ y, 0 ~ x^2 + y^2 - L^2 }
  local s = sweep(circle, { start = { x = 0 }, to = 0.1, params = { L = {1, 2} }, rtol = 1e-9, atol = 1e-9 })
  -- x = L sin t, y = L cos t with y > 0, or the other branch with both signs turned
  for i = 1, 2 do
    expect(s(x^2 + y^2, 0)[i]):near(i^2, 1e-9)
    expect(math.abs(s:final(x)[i])):near(i*math.sin(0.1), 1e-7)
  end
end)

test("failures are listed with parameters and reason", function()
  local blow = dae { der(x) ~ k*x^2 }                            -- x = 1/(1 - k t)
  local s = sweep(blow, { start = { x = 1 }, to = 1, params = { k = {0.5, 2, -1} }, rtol = 1e-8,
    atol = 1e-8 })
  expect(#s.failures):equals(1)
  expect(s.failures[1].index):equals(2)
  expect(s.failures[1].params.k):near(2, 0)
  expect(s.failures[1].why:find "stopped at t = 0.5" ~= nil or s.failures[1].why:find "0.49" ~= nil):is_true()
  expect(s:final(x)[1]):near(2, 1e-6)
  expect(s:final(x)[3]):near(0.5, 1e-7)
  expect(s:final(x)[2] ~= s:final(x)[2]):is_true()               -- nan, beside its parameters
  expect(s:statistics(x).count):equals(2)
  local text = tostring(s)
  expect(text:find "2 finished, 1 failed" ~= nil):is_true()
  expect(text:find("run 2 (k = 2)", 1, true) ~= nil):is_true()
  expect(text:find "nan" == nil):is_true()
  expect(s:table():find "failed" ~= nil):is_true()
  local L = param("L", 1)
  local start = sweep(dae { der(x) ~ y, 0 ~ x^2 + y^2 - L^2 },
    { start = { x = 0.6 }, to = 0.1, params = { L = {0.5, 1, 2} } })
  expect(#start.failures):equals(1)
  expect(start.failures[1].params.L):near(0.5, 0)
end)

test("Lua callbacks that cannot be evaluated with symbols run in the workers too", function()
  local u = input "u"
  local driven = dae { der(x) ~ -k*x + u }
  local s = sweep(driven, { start = { x = 0 }, to = 2, params = { k = linspace(1, 2, 8) }, method = rk.rk4,
    dt = 0.05,
                            inputs = { u = function(time) if time < 1 then return 1 end return 0 end } })
  for i = 1, 8 do
    local rate = s.params.k[i]
    -- the jump lies inside a stage
    expect(s:final(x)[i]):near((1 - math.exp(-rate))/rate*math.exp(-rate), 0.02)
  end
end)

test("events end runs at different times", function()
  local s = sweep(decay, { start = { x = 1 }, to = 5, params = { k = {1, 2, 0.1} }, rtol = 1e-10,
    atol = 1e-10,
                           events = { { when = x - 0.5, action = "stop" } } })
  expect(s:final(x)):near({0.5, 0.5, math.exp(-0.5)}, 1e-8)
  expect(s:final(t)):near({math.log(2), math.log(2)/2, 5}, 1e-8)
  local late = s(x, 4)
  expect(late[1] ~= late[1]):is_true()
  expect(late[3]):near(math.exp(-0.4), 1e-8)
end)

test("pictures and tables", function()
  local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = {1, 2} } })
  expect(tostring(s:plot(x)):find "1 series, 2 points" ~= nil):is_true()
  expect(tostring(plot(s.t, s(x))):find "figure" ~= nil):is_true()
  expect(s:table { x, x^2 }:find "x²" ~= nil):is_true()
end)

test("errors say what to write instead", function()
  local function fails(change, message)
    local o = { start = { x = 1 }, to = 1, params = { k = {1, 2} } }
    for key, value in pairs(change) do o[key] = value ~= "absent" and value or nil end
    expect(function() sweep(decay, o) end):fails(message)
  end
  fails({ start = "absent" }, "needs a start")
  fails({ to = "absent" }, "the end is missing")
  fails({ params = "absent" }, "nothing varies: give lists")
  fails({ params = { k = 2 } }, "nothing varies")
  fails({ params = { k = {} } }, "params.k is an empty list")
  fails({ params = { k = {1, 0/0} } }, "params.k contains nan")
  fails({ params = { q = {1, 2} } }, "'q'")
  fails({ start = { x = {1, 2, 3} } }, "the lists are paired, but k has 2 values and x has 3")
  fails({ workers = 0 }, "between 1 and 1024")
  fails({ lanes = 3 }, "lanes = 3; it must be 1 (one run after another), 4 or 8")
  fails({ gird = true }, "Did you mean 'grid'?")
  fails({ start = { 1, 2 } }, "start[1] must be a result of init or a table")
  fails({ method = "rk5" }, "unknown method 'rk5'")
  fails({ start = { y = 1 } }, "'y'")
  local s = sweep(decay, { start = { x = 1 }, to = 1, params = { k = {1, 2} } })
  expect(function() return s(x, 2) end):fails "t = 2 lies outside the sweep, which covers 0 ≤ t ≤ 1"
  expect(function() return s[3] end):fails "there are 2 runs; number 3 does not exist"
  expect(function() return s:final(y) end):fails "y"
  expect(function() return s:mean { x, x^2 } end):fails "expected one expression, got 2"
  expect(function() return s:plot() end):fails "expected an expression to draw"
end)
