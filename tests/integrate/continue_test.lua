-- Going on from a solution: sol:state() and sol:continue{ }.

local x, v, y, z = vars "x v y z"
local k = param("k", 2)
local spring = dae { der(x) ~ v, der(v) ~ -k*x }
local tight = { rtol = 1e-10, atol = 1e-10 }

local function with(options)
  for key, value in pairs(tight) do options[key] = value end
  return options
end

test("two pieces are one run, with the parameters of the run", function()
  local first = spring:integrate(with { start = { x = 1, v = 0 }, to = 1, params = { k = 3 } })
  local second = first:continue(with { to = 2 })
  expect(second.t[1]):equals(1)
  expect(second(x, 2)):near(math.cos(2*math.sqrt(3)), 1e-9)
  expect(spring:integrate(with { start = first:state(0.5), to = 2, params = { k = 3 } })(x, 2))
    :near(math.cos(2*math.sqrt(3)), 1e-9)
end)

test("reduced forms go on from their ends", function()
  local pendulum = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
  local at = pendulum:init { fix = { x = 0.6, [x.dot] = 0 }, guess = { y = -0.8 } }
  for _, form in ipairs { "acc", "project", "ggl" } do
    local low = pendulum:reduce(form)
    local whole = low:integrate(with { start = at, to = 2 })
    local second = low:integrate(with { start = at, to = 1 }):continue(with { to = 2 })
    expect(second(x, 2)):near(whole(x, 2), 1e-7)
  end
end)

test("a solution is a start: its end", function()
  local sol = spring:integrate(with { start = { x = 1, v = 0 }, to = 1, params = { k = 9 } })
  local more = spring:integrate(with { start = sol, to = 2 })
  expect(more.t[1]):equals(1.0)
  expect(more(x, 2)):near(math.cos(6), 1e-6)
  local r = input "r"
  local driven = dae { der(x) ~ r - x }
  local first = driven:integrate { start = { x = 0 }, to = 1, inputs = { [r] = 1 }, rtol = 1e-9, atol = 1e-9 }
  expect(driven:integrate { start = first, to = 2, inputs = { [r] = 1 }, rtol = 1e-9, atol = 1e-9 }(x, 2))
    :near(1 - math.exp(-2), 1e-7)
  expect(function() driven:integrate { start = first, to = 2 } end):fails "input"
end)

test("what is not understood is said", function()
  local sol = spring:integrate { start = { x = 1, v = 0 }, to = 1 }
  expect(function() spring:integrate { start = sol:stats(), to = 2 } end):fails "a solution or a table"
  expect(function() sol:continue(2) end):fails "options are a table { to = … }"
  expect(function() sol:continue{ to = 2, start = { x = 1 } } end):fails "unknown option 'start'"
end)
