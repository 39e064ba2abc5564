-- Adaptive runs of the library's reference problems: index 0 and 1 as they are, index 2 and 3 in the form
-- reduce() chooses and as they stand (direct = true). Published end values or exact solutions. With rtol =
-- atol = 1e-6 an error of 1000 tolerances (relative to the value) is allowed: errors of 100 steps, amplified
-- by the flow. Larger amplification is listed.
local tol = 1e-6
-- stiff springs; a drift that grows like t²; long swings
local amplified = { car_axis = 10, pendulum_acceleration = 10, cart_pendulum = 2 }
local without = {
  -- equations that direct = true cannot treat: the iteration matrix is singular for every step size
  direct = { exam_3d = true, hidden_sum = true, scholz_steinbrecher = true, kunkel_mehrmann = true,
    linear_combination = true,
    gear_petzold = true, substitution = true, coupled_outputs = true, rotating_nilpotent = true,
      catalyst_mixing = true },
  -- index 1, but x′ and z do not follow from the equations
  self = { reissig = true, opamp_integrator = true },
}
local function check(p, model, at, method, direct)
  local good, sol = pcall(model.integrate, model, { start = at, to = p.to, method = method,
    direct = direct or nil,
    inputs = p.inputs, rtol = tol, atol = tol })
  -- rodas needs a constant mass matrix, and says so
  if not good then
    if not tostring(sol):find "needs M x′ = f with a constant M" then error(sol, 0) end
    return
  end
  local label = ("%s, %s%s: "):format(p.name, method, direct and ", direct" or "")
  if sol.status ~= "finished" then expect(label .. sol.status):equals "finished" end
  local e, where = p:error(sol)
  if not (e <= 1000*(amplified[p.name] or 1)*tol) then
    expect(("%serror %.1e in %s"):format(label, e, tostring(where))):equals "smaller"
  end
end

local implicit = dofile "tests/families.lua".implicit

local count = 0
for _, p in ipairs(problems.list()) do
  if p.to and (p.exact or p.reference) and p.index then
    count = count + 1
    test("adaptive: " .. p.name, function()
      local at = p:start()
      local unfit = {
        substitution = "bdf",            -- z is a multiple of x₂′: bdf's error there is Newton's over h
        transistor_amplifier = "gauss",  -- R(∞) = -1 keeps its fast parts alive
      }
      local names = { "auto" }
      for _, name in ipairs(implicit) do
        if name ~= unfit[p.name] then names[#names + 1] = name end
      end
      local model = p()
      if p.index <= 1 and not without.self[p.name] then
        for _, method in ipairs(names) do check(p, model, at, method) end
      else
        local low = model:reduce()
        for _, method in ipairs(names) do check(p, low, at, method) end
      end
      if p.index >= 2 and p.index <= 3 and not without.direct[p.name] then
        check(p, model, at, "radau", true)
        -- its accelerations drown in the h⁻² of index 3
        if p.name ~= "car_axis" then check(p, model, at, "bdf", true) end
      end
    end)
  end
end

test("enough of them", function() expect(count >= 30):is_true() end)

test("methods that do not converge as it stands are refused", function()
  local p = problems.jay_index2
  for _, method in ipairs { "gauss", rk.gauss(2), rk.radau_ia(3) } do
    expect(function() p():integrate { start = p:start(), to = 1, method = method,
      direct = true } end):fails "not stiffly accurate"
  end
  expect(function() p():integrate { start = p:start(), to = 1, method = "rodas",
    direct = true } end):fails "for index 0 and 1"
  expect(function() p():integrate { start = p:start(), to = 1, method = "dop853",
    direct = true } end):fails "is explicit"
  local reissig = problems.reissig
  expect(function() reissig():integrate { start = reissig:start(),
    to = 1 } end):fails "index 1, but x′ and z do not follow"
end)

-- The coefficient of x₂ moves while the Jacobian is kept: one iteration must not vouch for itself.
test("purely algebraic equations with moving coefficients", function()
  local a, b = vars "a b"
  local model = dae { a - t/4*b ~ exp(-t), 0 ~ b - exp(-t) }
  for _, method in ipairs { "radau", "bdf", "gauss" } do
    local sol = model:integrate { start = { a = 1, b = 1 }, to = 1, method = method, rtol = 1e-8,
      atol = 1e-8 }
    expect(sol:final(a)):near(1.25*math.exp(-1), 1e-7)
  end
end)

-- corrections of the size of rounding have no rate
test("a constant slope", function()
  local x = var "x"
  for _, row in ipairs(methods()) do
    local sol = dae { der(x) ~ -0.7 }:integrate { start = { x = 1 }, to = 3, method = row.name, rtol = 1e-8,
      atol = 1e-10 }
    expect(sol.status):equals "finished"
    expect(sol:final(x)):near(-1.1, 1e-12)
  end
end)
