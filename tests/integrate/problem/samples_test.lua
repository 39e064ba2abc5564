-- Inputs known at samples. x′ = -x + u with u constant on pieces: x ← uₖ + (x - uₖ) e^{-h}.
local families = dofile "tests/families.lua"
local x, z, u = var "x", var "z", input "u"
local model = dae { der(x) ~ -x + u }
local values = { 1, -1, 2, 0, 5, 1, 1, -3, 2, 4 }
local function held(T)
  local result, at, k = 0, 0, 1
  while at < T - 1e-12 do
    local h = math.min(0.1, T - at)
    result, at, k = values[k] + (result - values[k])*math.exp(-h), at + h, math.min(k + 1, #values)
  end
  return result
end
local forms = { iddata { y = values, u = values, Ts = 0.1 },
  { t = linspace(0, 0.9, 10), u = values, hold = "zero" },
  { Ts = 0.1, u = values, hold = "zero" } }

test("held samples: steps end where the input jumps", function()
  for _, samples in ipairs(forms) do
    for method, tol in pairs { auto = 1e-9, dopri5 = 1e-9, radau = 1e-9, gauss = 1e-9, rodas = 1e-9,
      bdf = 1e-8 } do
      local sol = model:integrate { start = { x = 0 }, to = 1, inputs = { u = samples }, method = method,
        rtol = 1e-9 }
      for _, T in ipairs { 0.1, 0.37, 0.55, 1 } do expect(sol(x, T)):near(held(T), tol) end
      expect(sol(u, 0.25)):equals(2)
    end
    local before
    for _, dt in ipairs { 0.1, 0.05 } do                          -- order 4 in spite of the jumps
      local e = math.abs(model:integrate { start = { x = 0 }, to = 1, inputs = { u = samples }, dt = dt,
        method = rk.rk4 }:final(x) - held(1))
      expect(before == nil or before/e > 14):is_true()
      before = e
    end
  end
end)

test("straight lines between samples, and their derivative", function()
  local exact = 2*(0.9 - 1 + math.exp(-0.9)) - 4*(0.4 - 1 + math.exp(-0.4))
  for _, samples in ipairs { { { 0, 0 }, { 0.5, 1 }, { 1, 0 } }, { t = { 0, 0.5, 1 }, u = { 0, 1, 0 } } } do
    expect(model:integrate { start = { x = 0 }, to = 0.9, inputs = { u = samples },
      rtol = 1e-10 }:final(x)):near(exact, 1e-9)
  end
  local tracking = dae { der(x) ~ z, 0 ~ x - u }:reduce()          -- needs u′
  local sol = tracking:integrate { start = { x = 0 }, to = 0.9,
    inputs = { u = { Ts = 0.1, u = { 0, 1, 2, 2, 2, 3, 3, 3, 0, 0 } } } }
  expect(sol(x, 0.55)):near(3, 1e-9)
  expect(sol(z, 0.15)):near(10, 1e-9)
  expect(sol(z, 0.75)):near(-30, 1e-9)
end)

test("events between and at samples", function()
  local sol = model:integrate { start = { x = 0 }, to = 1, inputs = { u = forms[1] },
    events = { { when = t - 0.5, reset = { x = 7 } } } }
  expect(sol(x, 0.4999999)):near(held(0.4999999), 1e-6)
  expect(sol(x, 0.5)):equals(7)
end)

test("bad samples are refused", function()
  local function refuse(samples, words, to)
    expect(function() model:integrate { start = { x = 0 }, to = to or 1,
      inputs = { u = samples } } end):fails(words)
  end
  refuse({ t = { 0, 1, 1 }, u = { 1, 2, 3 } }, "the times must ascend, but t[3] = 1 follows 1")
  refuse({ t = { 0, 1 }, u = { 1, 2, 3 } }, "2 times for 3 values")
  refuse({ t = { 0, 1 }, v = { 1, 2 } }, "unknown field 'v'")
  refuse({ t = { 0, 1 } }, "has no values")
  refuse({ u = { 1, 2 } }, "either t = {…} or Ts = 0.1")
  refuse({ Ts = -1, u = { 1, 2 } }, "Ts must be a positive number")
  refuse({ t = { 0, 1 }, u = { 1, 0/0 } }, "sample 2")
  refuse({ t = { 0, 1 }, u = { 1, 0 }, hold = "cubic" }, "hold")
  refuse({ 1, 2, 3 }, "samples need their times")
  refuse({ t = { 0.5, 1 }, u = { 1, 0 } }, "known for 0.5 ≤ t ≤ 1 only")
  local sol = model:integrate { start = { x = 0 }, to = 3, inputs = { u = { t = { 0, 1 }, u = { 1, 0 } } } }
  expect(sol.status):equals "stopped at t = 1: the input u is known for 0 ≤ t ≤ 1 only"
end)

local names = {}                                           -- those for tight tolerances
for _, method in ipairs(methods()) do
  if (method.order or 5) >= (method.explicit and 5 or 4) then names[#names + 1] = method.name end
end

-- x′ = u: the integral of u, exact on every piece. Functions with `if` cannot be evaluated with symbols.
test("jumps of inputs written in Lua are found", function()
  local integral = dae { der(x) ~ u }
  local function run(f, method, rtol)
    return integral:integrate { start = { x = 0 }, to = 3, inputs = { u = f }, method = method, rtol = rtol }
  end
  for _, method in ipairs(names) do
    expect(run(function(s) if s > 1.3 then return 2 end return 1 end, method):final(x)):near(4.7, 1e-12)
    -- eleven jumps
    local wave = run(function(s) if 4*s//1 % 2 == 0 then return 1 end return -1 end, method)
    expect(wave(x, 2.25)):near(0.25, 1e-5)
    expect(math.abs(wave:final(x)) < 1e-5):is_true()
    local smooth = run(function(s) return math.sin(tonumber(s) or error "no symbols") end, method, 1e-8)
    expect(smooth:final(x)):near(1 - math.cos(3), 1e-6)
  end
  -- steep, but no jump
  local root = run(function(s) if s < 1 then return 0 end return (s - 1)^0.5 end, "radau", 1e-8)
  expect(root:final(x)):near(2/3*2^1.5, 1e-6)
end)

-- x′ = -x + u, x(0) = 0, by Simpson's rule between the kinks of u: without breaks there 130 tolerances at
-- rtol 1e-8.
test("kinks of inputs written in Lua are found", function()
  local follow = dae { der(x) ~ -x + u }
  local function exact(f, kinks, last)
    local sum, ends, n = 0, { 0, table.unpack(kinks) }, 400
    ends[#ends + 1] = last
    for k = 1, #ends - 1 do
      local h = (ends[k + 1] - ends[k])/n
      for i = 0, n do
        local s = ends[k] + i*h
        sum = sum + ((i == 0 or i == n) and 1 or i % 2 == 1 and 4 or 2)*h/3*math.exp(s - last)*f(s)
      end
    end
    return sum
  end
  local cases = {
    { function(s) return math.abs(s - 1.234567) end, { 1.234567 } },
    { function(s) return 3*math.max(0, s - 1.234567) end, { 1.234567 } },
    { function(s) return math.abs(s % 2 - 1) end, { 1, 2, 3, 4 } },
    { function(s) return math.abs(math.sin(3*s)) end, { math.pi/3, 2*math.pi/3, math.pi, 4*math.pi/3 } },
    { function(s) return 5 + math.min(math.cos(s), 0.3) end, { math.acos(0.3) } },
  }
  for i, case in ipairs(cases) do
    local f, kinks = table.unpack(case)
    for _, method in ipairs(families.with("dopri5", "dop853")) do
      local sol = follow:integrate { start = { x = 0 }, to = 4.5, inputs = { u = f }, method = method,
        rtol = 1e-8 }
      local value = exact(f, kinks, 4.5)
      local error = math.abs(sol:final(x) - value)/(1e-8*value)
      if error > (method == "bdf" and 20 or 3) then
        expect(("%d %s: %.3g tolerances"):format(i, method, error)):equals ""
      end
    end
  end
end)

-- Its jump at the beginning has a step of a moment; without it runs stopped at t = 0.
test("an input that begins to act behind the start", function()
  for _, method in ipairs { "radau", "dopri5", "bdf", "rodas" } do
    local sol = dae { der(x) ~ -x + u } :integrate { start = { x = 0 }, to = 3, method = method, rtol = 1e-6,
      inputs = { u = function(s) if s > 0 then return 1 end return 0 end } }
    expect(sol.status):equals "finished"
    expect(sol:final(x)):near(1 - math.exp(-3), 2e-6)
  end
end)

test("smooth inputs and rounded numbers have no kinks", function()
  local follow = dae { der(x) ~ -x + u }
  local function run(f, method)
    local calls = 0
    local function counted(s)
      calls = calls + 1
      return f(s)
    end
    local sol = follow:integrate { start = { x = 0.3 }, to = 10, method = method, rtol = 1e-4,
      inputs = { u = counted } }
    local of_the_run = calls                           -- stats() judges steps by others, which call, too
    return sol:stats().steps, of_the_run
  end
  local function smooth(s) return math.sin(s) end
  for _, method in ipairs { "dopri5", "radau" } do
    local steps, calls = run(smooth, method)
    expect(calls - 2049 < 30*steps):is_true()                 -- as many once, beforehand
    for _, digits in ipairs { 1e4, 1e6 } do  -- of a converter: every step meets many of its jumps
      expect((run(function(s) return math.sin(s)*digits//1/digits end, method))):near(steps, steps/4)
    end
  end
end)
