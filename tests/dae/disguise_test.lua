-- Models whose index, degrees of freedom and solution are known by construction: Weierstrass forms
--   v′ = A v,   0 = w₁ + g,   w₁′ = w₂,   w₂′ = w₃ …        (index = length of the chain)
-- disguised by nonlinear maps of the unknowns, by combinations of the equations with multipliers that vary,
-- and by units of the unknowns and equations between 10⁻¹² and 10¹². Seeded: the same models in every run.
local random = {}
function random.new(seed)
  local state = seed * 7919 + 17
  return function(n)                                        -- an integer in 1 … n
    state = (state * 1103515245 + 12345) % 2147483648
    return state // 65536 % n + 1
  end
end

-- Unknowns y with w_i = y_i / unit_i + h_i(earlier ones, t); h: 0 for a linear disguise.
local function maps(draw, y, units, linear)
  local w = {}
  for i = 1, #y do
    local own, before = y[i] / units[i], w[i - 1]
    local kind = (i == 1 or linear) and 1 or draw(5)
    w[i] = kind == 1 and own or kind == 2 and own + before^2 / 2 or kind == 3 and own + sin(before)
      or kind == 4 and own + before * cos(t) or own + exp(before / 3) - 1
  end
  return w
end

-- Values of y for values of w: the maps are triangular.
local function values(w, y, units, target, at)
  local out = {}
  for i = 1, #y do
    local rest = subs(w[i], { [y[i]] = 0 })
    local function number(e)
      for j = 1, i - 1 do e = subs(e, { [y[j]] = out[j] }) end
      e = subs(e, { [t] = at })
      return evaluate(e, {})
    end
    out[i] = (target[i] - number(rest)) * units[i]
  end
  return out
end

-- The k-th derivative of -sin t.
local function chain_value(k, at)
  return ({ -math.sin(at), -math.cos(at), math.sin(at), math.cos(at) })[k % 4 + 1]
end

local function disguised(seed, index, dof, linear)
  local draw = random.new(seed)
  local n = math.max(dof + index, 1)
  local y, units = {}, {}
  for i = 1, n do
    y[i] = var("y" .. i)
    units[i] = 10.0^(draw(25) - 13)
  end
  local w = maps(draw, y, units, linear)
  local F = {}
  for i = 1, dof do F[i] = der(w[i]) + w[i] * (i > 1 and 1 or 2) - (i > 1 and w[i - 1] or 0) end
  for k = 1, index do
    F[dof + k] = k == 1 and w[dof + 1] + sin(t) or der(w[dof + k - 1]) - w[dof + k]
  end
  local equations = {}
  for i = 1, n do                                             -- a row of a triangular matrix with units
    local sum = F[i]
    if i > 1 then sum = sum + (linear and draw(3) - 2 or cos(t) * w[i - 1]) * F[i - 1] end
    equations[i] = sum * 10.0^(draw(25) - 13) ~ 0
  end
  return dae(equations), y, w, units
end

local function check(seed, index, dof, linear)
  local sys, y, w, units = disguised(seed, index, dof, linear)
  local name = ("seed %d, index %d, dof %d%s"):format(seed, index, dof, linear and ", linear" or "")
  local ok, found = pcall(function() return sys:index() end)
  expect(name .. ": " .. tostring(found)):equals(name .. ": " .. index)
  expect(name .. ": dof " .. sys:dof()):equals(name .. ": dof " .. dof)
  local at, target = 0.3, {}
  for i = 1, dof do target[i] = 0.5 + 0.2 * i end
  for k = 1, index do target[dof + k] = chain_value(k - 1, at) end
  local exact = values(w, y, units, target, at)
  local fix, guess = {}, {}
  for i = 1, #y do (i <= dof and fix or guess)[y[i]] = exact[i] end
  local started, start = pcall(function() return sys:init { from = at, fix = fix, guess = guess } end)
  expect(name .. (started and "" or ": " .. tostring(start))):equals(name)
  for i = 1, #y do
    local error = math.abs(start(y[i]) - exact[i]) / (math.abs(exact[i]) + units[i])
    local wrong = (": y%d = %g, not %g"):format(i, start(y[i]), exact[i])
    expect(name .. (error < 1e-6 and "" or wrong)):equals(name)
  end
end

test("linear disguises of index 0 to 6", function()
  for seed = 1, 28 do check(seed, seed % 7, (seed // 7) % 3 + (seed % 7 == 0 and 1 or 0), true) end
end)

test("nonlinear disguises of index 0 to 3", function()
  for seed = 1, 16 do check(seed, seed % 4, (seed // 4) % 3 + (seed % 4 == 0 and 1 or 0), false) end
end)
