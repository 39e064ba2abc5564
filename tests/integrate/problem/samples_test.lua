-- Inputs known at samples. x′ = -x + u with u constant on pieces: x ← uₖ + (x - uₖ) e^{-h}.
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

-- x′ = u: the integral of u, exact on every piece. Functions with `if` cannot be followed with symbols.
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
