-- sys:prepare{ }: the numbers of integrate, bit for bit, for every kind of model and method.

local x, v, y, u, z, w = vars "x v y u z w"
local k, g = param("k", 2), param("g", 9.81)
local F = input "F"

local function same(a, b)
  expect(#a.t):equals(#b.t)
  for i = 1, #a.t do
    expect(a.t[i] == b.t[i]):equals(true)
  end
  for _, part in ipairs { a.model.differential, a.model.algebraic } do
    for i = 1, #part do
      local left, right = a(part[i]), b(part[i])
      for j = 1, #a.t do
        if left[j] ~= right[j] then fail(("%s differs at t = %g"):format(part[i], a.t[j])) end
      end
    end
  end
end

-- Models are made anew, so that nothing is remembered for the right side of a comparison.
local cases = {
  spring = { make = function() return dae { der(x) ~ v, der(v) ~ -k*x } end,
    start = { x = 1, v = 0 }, other = { x = -0.5, v = 3 }, params = { k = 7 } },
  ["spring, radau"] = { make = function() return dae { der(x) ~ v, der(v) ~ -k*x } end,
    fixed = { method = "radau" }, start = { x = 1, v = 0 }, other = { x = 1e6, v = 3 },
    params = { k = 0.1 } },
  driven = { make = function() return dae { der(x) ~ v, der(v) ~ -k*x + F } end,
    fixed = { inputs = { [F] = k*sin(3*t) } }, start = { x = 0, v = 0 }, other = { x = 1, v = 0 },
    params = { k = 5 } },
  ["driven by a function"] = { make = function() return dae { der(x) ~ v, der(v) ~ -k*x + F } end,
    fixed = { inputs = { [F] = function(time) return math.floor(time) % 2 end }, method = "bdf" },
    start = { x = 0, v = 0 }, other = { x = 1, v = 0 }, params = { k = 5 } },
  implicit = { make = function() return dae { der(x) + z^3 ~ -k*x, 0 ~ z + z^5 - x } end,
    start = { x = 1 }, other = { x = -2 }, params = { k = 3 } },
  ["index 1, rodas"] = { make = function() return dae { der(x) ~ -k*z, 0 ~ z - x - 0.1*sin(z) } end,
    fixed = { method = "rodas" }, start = { x = 1 }, other = { x = -2 }, params = { k = 300 } },
  piecewise = { make = function() return dae { der(x) ~ v, der(v) ~ -k*max(x, 0) - x } end,
    start = { x = 1, v = 0 }, other = { x = -1, v = 0 }, params = { k = 50 } },
  ["a border that moves"] = { make = function() return dae { der(x) ~ v, der(v) ~ -x - max(x - k/4, 0) } end,
    start = { x = 1, v = 0 }, other = { x = -1, v = 2 }, params = { k = 3 } },
  -- no jump for k = 2, a jump of 1 for k = 3
  ["a border that becomes a jump"] = { make = function()
    return dae { der(x) ~ v, der(v) ~ -x + ifelse(lt(x, 0.5), 0, 2 - k) } end,
    start = { x = 1, v = 0 }, other = { x = 0, v = 2 }, params = { k = 3 } },
  ["with an event"] = { make = function() return dae { der(x) ~ v, der(v) ~ -g } end,
    fixed = { events = { { when = x, direction = -1, reset = { [v] = -0.9*v } } } },
    start = { x = 1, v = 0 }, other = { x = 2, v = 1 }, params = { g = 1.62 } },
  ["with sensitivities"] = { make = function() return dae { der(x) ~ v, der(v) ~ -k*x } end,
    fixed = { sensitivities = { k } }, start = { x = 1, v = 0 }, other = { x = 0, v = 3 },
    params = { k = 7 } },
}
for _, form in ipairs { "project", "acc", "ggl", "baumgarte", "dummy", "array" } do
  cases["pendulum, " .. form] = { make = function()
    return dae { der(x) ~ u, der(y) ~ w, der(u) ~ -z*x, der(w) ~ -z*y - g, 0 ~ x^2 + y^2 - 1 } end,
    fixed = { form = form }, start = { x = 1, y = 0, u = 0, w = 0 },
    other = { x = 0.6, y = -0.8, u = 4, w = 3 },
    params = { g = 1.62 } }
end

local function options(case, start, params, rtol, to)
  local all = { start = start, params = params, rtol = rtol, to = to }
  for name, value in pairs(case.fixed or {}) do if name ~= "form" then all[name] = value end end
  return all
end

for name, case in pairs(cases) do
  test("a prepared run is integrate: " .. name, function()
    local form = (case.fixed or {}).form
    local run = case.make():prepare(case.fixed)
    local function fresh(...)
      local model = case.make()
      return (form and model:reduce(form) or model):integrate(options(case, ...))
    end
    local calls = { { case.start, nil, 1e-6, 1.5 }, { case.other, case.params, 1e-4, 0.7 },
      { case.start, case.params, 1e-8, 1.5 }, { case.start, nil, 1e-6, 1.5 } }
    -- Implicit steps become machine code on the way, equal to rounding: first until that is made.
    for _ = 1, 30 do
      for _, call in ipairs(calls) do fresh(table.unpack(call, 1, 4)) end
    end
    for _, call in ipairs(calls) do
      local start, params, rtol, to = table.unpack(call, 1, 4)
      same(run { start = start, params = params, rtol = rtol, to = to }, fresh(start, params, rtol, to))
    end
  end)
end

test("what is not fixed may be given beforehand, and overridden", function()
  local run = dae { der(x) ~ -k*x } :prepare { to = 1, rtol = 1e-10, start = { x = 1 } }
  expect(run {} :final(x)):near(math.exp(-2), 1e-9)
  expect(run { to = 2 } :final(x)):near(math.exp(-4), 1e-9)
  expect(tostring(run)):equals("prepared run of a model with 1 equation, given: rtol, start, to: "
    .. "run{ start =, to =, … }")
end)

test("what is fixed, unknown or missing is said", function()
  local decay = dae { der(x) ~ -k*x }
  local run = decay:prepare { method = "radau" }
  expect(function() run { start = { x = 1 }, method = "bdf" } end):fails "'method' was fixed by prepare"
  expect(function() run { start = { x = 1 }, events = {} } end):fails "'events' was fixed by prepare"
  expect(function() run { start = { x = 1 }, too = 1 } end):fails "Did you mean 'to'?"
  expect(function() run(1) end):fails "options are a table { start = … }"
  expect(function() run { start = { x = 1 } } end):fails "the end is missing"
  expect(function() decay:prepare { metod = "radau" } end):fails "Did you mean 'method'?"
  expect(function() decay:prepare "radau" end):fails 'options are a table { form = … }'
  local high = dae { der(x) ~ v, 0 ~ x - 1 }
  expect(function() high:prepare {} end):fails "index 2"
end)

test("a start of a relative is translated once, and again where it or the model is another", function()
  local q, w, lam = vars "q w lam"
  local swing = dae { der(q) ~ w, der(w) ~ -lam, 0 ~ lam - sin(q) }
  local low = swing:eliminate()
  for _, angle in ipairs { 0.3, 0.7 } do
    local at = swing:init { fix = { q = angle, w = 0 } }
    for _ = 1, 3 do
      expect(low:integrate { start = at, to = 1 }(q, 0)):near(angle, 1e-14)
      expect(swing:integrate { start = at, to = 1 }(q, 0)):near(angle, 1e-14)
    end
  end
end)
