-- sweep on SIMD lanes: the results are those of single runs, and what lanes cannot do goes the ordinary road.
local x, y, z = vars "x y z"
local k, mu, rho, l = params "k=1 mu=1 rho=28 l=1"
local decay = dae { der(x) ~ -k*x }
local theta = var "theta"
local pendulum = dae { der(theta, 2) ~ -9.81/l*sin(theta) }
local vdp = dae { der(x) ~ y, der(y) ~ mu*(1 - x^2)*y - x }
local volterra = dae { der(x) ~ k*x - x*y, der(y) ~ x*y - y }
local lorenz = dae { der(x) ~ 10*(y - x), der(y) ~ x*(rho - z) - y, der(z) ~ x*y - 8/3*z }
local has_lanes = sweep(decay, { start = { x = 1 }, to = 1, params = { k = {1, 2} },
  lanes = 8 }):stats().lanes > 1

local function with(options, more)
  local all = {}
  for key, value in pairs(options) do all[key] = value end
  for key, value in pairs(more) do all[key] = value end
  return all
end
local function same(a, b, tolerance)                             -- columns that may contain nan
  for i = 1, #a do
    if a[i] ~= a[i] or b[i] ~= b[i] then expect(a[i] ~= a[i] and b[i] ~= b[i]):is_true()
    else expect(a[i]):near(b[i], tolerance) end
  end
end

test("four models: lanes against one run after another", function()
  -- rtol 1e-9; errors grow along the solutions, differences stay a part of them
  local cases = {
    { pendulum, { theta = 2, [theta.dot] = 0 }, 10, { l = linspace(1, 2, 33) }, theta, 1e-8 },
    { volterra, { x = 2, y = 1 }, 10, { k = linspace(0.5, 2, 33) }, x, 1e-8 },
    { vdp, { x = 2, y = 0 }, 10, { mu = linspace(0.5, 1.5, 33) }, x, 1e-8 },
    { lorenz, { x = 1, y = 1, z = 1 }, 2, { rho = linspace(20, 28, 33) }, z, 1e-7 },
  }
  for _, case in ipairs(cases) do
    local options = { start = case[2], to = case[3], params = case[4], rtol = 1e-9, atol = 1e-9 }
    local many, one = sweep(case[1], options), sweep(case[1], with(options, { lanes = 1 }))
    expect(#many.failures):equals(0)
    if has_lanes then expect(many:stats().why:find "runs at a time on SIMD lanes" ~= nil):is_true() end
    same(many:final(case[5]), one:final(case[5]), case[6])
    same(many(case[5], case[3]/3), one(case[5], case[3]/3), case[6])             -- not a saved time
    same(many(der(case[5]), 1), one(der(case[5]), 1), 100*case[6])
    expect(math.abs(many:stats().steps - one:stats().steps) <= 3):is_true()
    local four = sweep(case[1], with(options, { lanes = 4, workers = 2 }))
    same(many:final(case[5]), four:final(case[5]), 0)                            -- to the bit
  end
end)

-- One controller and one step serve both: where the equations give the same bits, the steps are the same,
-- also where stability limits them (x follows y on the edge of the stability region) and where the flow
-- is chaotic.
test("lanes take the steps of single runs", function()
  local relax = dae { der(x) ~ -k*(x - y), der(y) ~ -y/10 }
  local cases = {
    { relax, { x = 1, y = 1 }, { k = linspace(1, 100, 32) } },
    { relax, { x = 1, y = 1 }, { k = linspace(10, 1000, 32) } },
    -- the default atol knows sizes above 1000: on lanes those of one set
    { relax, { x = 1e6, y = 1e-6 }, { k = linspace(5, 50, 32) }, 1e-13 },
    { vdp, { x = 2, y = 0 }, { mu = linspace(1, 30, 32) } },
    { lorenz, { x = 1, y = 1, z = 1 }, { rho = linspace(20, 28, 32) } },
  }
  for _, case in ipairs(cases) do
    for _, method in ipairs { "dop853", "dopri5", "tsit5", "verner87" } do
      local options = { start = case[2], to = 10, params = case[3], rtol = 1e-10, method = method,
        atol = case[4] }
      local many = sweep(case[1], options):stats()
      local one = sweep(case[1], with(options, { lanes = 1 })):stats()
      if has_lanes then expect(many.lanes > 1):is_true() end
      expect(many.steps):equals(one.steps)
      expect(many.rejected):equals(one.rejected)
    end
  end
end)

test("any number of runs, with a sign that changes", function()
  for _, n in ipairs { 1, 3, 7, 8, 9, 17 } do
    local rates = {}
    for i = 1, n do rates[i] = -1 + 0.25*i end
    local s = sweep(decay, { start = { x = 1 }, to = 2, params = { k = rates }, rtol = 1e-10, atol = 1e-12,
      lanes = 8 })
    for i = 1, n do expect(s:final(x)[i]):near(math.exp(-2*rates[i]), 1e-8) end
    expect(s(x^2 + k, 1)[n]):near(math.exp(-2*rates[n]) + rates[n], 1e-8)
  end
end)

test("failures keep to themselves: domains left, poles, too many steps", function()
  local options = { start = { x = 1 }, to = 1, params = { k = linspace(-1, 1, 1000) }, rtol = 1e-9,
    atol = 1e-9 }
  local s = sweep(dae { der(x) ~ -sqrt(k)*x }, options)
  expect(#s.failures):equals(500)
  expect(s.failures[1].index):equals(1)
  expect(s.failures[1].why:find "√k is undefined" ~= nil):is_true()
  for i = 501, 1000 do expect(s:final(x)[i]):near(math.exp(-math.sqrt(s.params.k[i])), 1e-8) end
  local blow = dae { der(x) ~ k*x^2 }                            -- x = 1/(1 - k t)
  local b = sweep(blow, with(options, { params = { k = {0.5, 2, -1, 0.25, 4, -8, 0, 0.75, 3} } }))
  expect(#b.failures):equals(3)
  expect(b.failures[2].why:find "stopped at t = 0.25" ~= nil
    or b.failures[2].why:find "0.249" ~= nil):is_true()
  for i, rate in ipairs { 0.5, 2, -1, 0.25, 4, -8, 0, 0.75, 3 } do
    if rate < 1 then expect(b:final(x)[i]):near(1/(1 - rate),
      1e-7) else expect(b:final(x)[i] ~= b:final(x)[i]):is_true() end
  end
  local few = sweep(vdp, { start = { x = 2, y = 0 }, to = 20, params = { mu = linspace(0.1, 5, 20) },
    max_steps = 40 })
  expect(#few.failures > 0 and #few.failures < 20):is_true()
  expect(few.failures[1].why:find "max_steps = 40 steps were not enough" ~= nil):is_true()
end)

test("runs that turn out stiff change to the ordinary road", function()
  local options = { start = { x = 2, y = 0 }, to = 20,
    params = { mu = {1, 10, 100, 1000, 1e4, 1, 2, 0.5, 1e5} } }
  local s, one = sweep(vdp, options), sweep(vdp, with(options, { lanes = 1 }))
  expect(#s.failures):equals(0)
  same(s:final(x), one:final(x), 1e-5)
  if has_lanes then expect(s:stats().why:find "one after another" ~= nil):is_true() end
end)

test("starts of every kind, inputs, another beginning", function()
  local u = input "u"
  local driven = dae { der(x) ~ -k*x + u }
  local options = { start = { x = linspace(0, 1, 16) }, from = 1, to = 2, inputs = { [u] = sin(t)*k },
    rtol = 1e-10, atol = 1e-10 }
  local s, one = sweep(driven, options), sweep(driven, with(options, { lanes = 1 }))
  same(s:final(x), one:final(x), 1e-9)
  same(s(u + der(x), 1.5), one(u + der(x), 1.5), 1e-8)
  local list = {}
  for i = 1, 9 do list[i] = i % 2 == 0 and { x = i } or decay:init { fix = { x = i } } end
  local starts = sweep(decay, { start = list, to = 1, rtol = 1e-10, atol = 1e-10 })
  for i = 1, 9 do expect(starts:final(x)[i]):near(i*math.exp(-1), 1e-8) end
  -- x follows
  local slope = sweep(decay, { start = { [x.dot] = linspace(-1, -9, 9) }, to = 1, rtol = 1e-10,
    atol = 1e-10 })
  for i = 1, 9 do expect(slope:final(x)[i]):near(i*math.exp(-1), 1e-8) end
end)

test("the sweep says why there are no lanes", function()
  local function why(model, options) return sweep(model,
    with({ start = { x = 1 }, to = 1, params = { k = linspace(1, 2, 9) } }, options)):stats().why end
  expect(why(decay, { lanes = 1 })):equals "one run after another: lanes = 1 was asked for"
  if not has_lanes then return end
  expect(why(decay, { params = { k = {1, 2} } }):find "2 runs do not fill" ~= nil):is_true()
  expect(why(decay, { method = "radau" }):find "radau is implicit" ~= nil):is_true()
  expect(why(decay, { method = rk.rk4, dt = 0.1 }):find "steps are fixed" ~= nil):is_true()
  expect(why(decay, { events = { { when = x - 0.5,
    action = "stop" } } }):find "events are watched" ~= nil):is_true()
  expect(why(dae { der(x) ~ -k*abs(x) }, {}):find "equations switch" ~= nil):is_true()
  expect(why(decay, { to = 1e6 }):find "stiff" ~= nil):is_true()
  expect(why(dae { der(x) ~ -y, 0 ~ y - k*x }, {}):find "not an explicit ODE" ~= nil):is_true()
  expect(why(decay, { method = "dopri5" }):find "SIMD lanes, dopri5" ~= nil):is_true()
  expect(tostring(sweep(decay, { start = { x = 1 }, to = 1,
    params = { k = {1, 2} } }):stats()):find "steps" ~= nil):is_true()
end)

test("lanes do not run across poles", function()
  local a = params "a=1"
  local pole = dae { der(x) ~ -a/x^2 }
  local many = sweep(pole, { start = { x = 1 }, to = 2, params = { a = linspace(0.05, 2, 64) }, rtol = 1e-4 })
  local one = sweep(pole, { start = { x = 1 }, to = 2, params = { a = linspace(0.05, 2, 64) }, rtol = 1e-4,
    lanes = 1 })
  expect(#many.failures):equals(#one.failures)
  expect(#many.failures > 50):equals(true)                        -- x³ = 1 - 3at: a > 1/6 ends before t = 2
  same(many:final(x), one:final(x), 1e-4)
  local bounded = sweep(dae { der(x) ~ a, der(y) ~ sin(x)/x }, { start = { x = -1, y = 0 }, to = 2,
    params = { a = linspace(0.6, 2.1, 33) } })
  expect(#bounded.failures):equals(0)
end)
