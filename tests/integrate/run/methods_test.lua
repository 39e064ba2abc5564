-- A suite over every tableau that is registered: a new one is tested by being listed.
local methods = {}
for name, tab in pairs(rk) do
  if type(tab) == "tableau" then methods[#methods + 1] = { name = name, tab = tab } end
end
for _, tab in ipairs { rk.gauss(1), rk.gauss(2), rk.gauss(3), rk.gauss(4), rk.radau(2), rk.radau(3),
  rk.collocation { 0, "1/2", 1 } } do
  methods[#methods + 1] = { name = tab.name, tab = tab }
end
table.sort(methods, function(a, b) return a.name < b.name end)

local x, y, z = vars "x y z"

-- Nonlinear, non-autonomous, with solutions in closed form; a linear problem sees only the tall trees.
local problems = {
  { name = "x' = t x^2", model = dae { der(x) ~ t * x^2 }, start = { x = 0.5 }, exact = 1 / 1.5 },
  { name = "x' = x y, y' = -log x", model = dae { der(x) ~ x * y, der(y) ~ -log(x) },
    start = { x = 1, y = 1 },
    exact = math.exp(math.sin(1)) },
  { name = "x' = -z, z^3 + z = x^2 + t (index 1)", model = dae { der(x) ~ -z, 0 ~ z^3 + z - x^2 - t },
    start = { x = 1 } },
}

local function at_one(problem, tab, dt)
  return problem.model:integrate { start = problem.start, to = 1, method = tab, dt = dt }:final(x)
end

for _, problem in ipairs(problems) do
  if not problem.exact then problem.exact = at_one(problem, rk.gauss(6), 1 / 32) end
end

for _, method in ipairs(methods) do
  local tab, p = method.tab, method.tab:order()
  test(method.name .. " says where it comes from", function()
    expect(#tab.text > 0 or tab.name == "collocation"):is_true()
    expect(#tab.cite > 0):is_true()
  end)
  test(method.name .. " is what it claims to be", function()
    local proved = tab:proved()
    expect(proved:order()):equals(p)
    expect(proved:dense_order()):equals(tab:dense_order())
  end)
  test(method.name .. " converges at its order", function()
    -- Steps so small that the leading term dominates, errors so large that rounding (1e-14) does not.
    -- One-sided: lucky cancellation may give more; where an error passes through zero, the next halving
    -- decides. A quarter below is admitted for the next term (dopri5 reaches 4.78 on x y before rounding
    -- begins); a method of order p - 1 shows p - 1.
    local dt = p <= 2 and 1 / 64 or p <= 5 and 1 / 32 or p == 6 and 1 / 16 or 1 / 8
    for _, problem in ipairs(problems) do
      local errors = {}
      for k = 0, 3 do errors[k] = math.abs(at_one(problem, tab, dt / 2^k) - problem.exact) end
      local slope = 0
      for k = 1, 3 do slope = math.max(slope, math.log(errors[k - 1] / errors[k], 2)) end
      if slope < p - 0.25 and errors[1] > 1e-13 then
        error(("%s: slope %.2f, order %d"):format(problem.name, slope, p)) end
    end
  end)
  test(method.name .. " integrates polynomials of its degree exactly", function()
    local model = dae { der(x) ~ p * t^(p - 1) }
    local sol = model:integrate { start = { x = 0 }, to = 1, method = tab, dt = 0.25 }
    local size = 0                                         -- 4 steps of a few roundings of Σ|b| each
    for i = 1, tab.stages do size = size + math.abs(evaluate(tab.b[i])) end
    expect(sol:final(x)):near(1, 4e-15 * size)
  end)
end

test("models without states are followed by every method", function()
  local u, v, w = vars "u v w"
  local sys = dae { der(u) ~ v, der(v) ~ w + u^2, 0 ~ u - sin(t) }
  local low = sys:reduce "dummy"
  expect(#low:integrate { to = 1 }.t > 1):is_true()
  for _, method in ipairs { "auto", "dopri5", "tsit5", "dop853", "verner98", "rkc", "radau", "bdf", "rodas",
    "gauss" } do
    local sol = low:integrate { start = {}, to = 3, method = method }
    expect(method .. sol.status):equals(method .. "finished")
    expect(sol(w, 3)):near(-math.sin(3) - math.sin(3)^2, 1e-6)
  end
end)

test("an explicit method that needs x′ from equations that leave it open names others", function()
  local sys = dae { der(x) + der(y) ~ -x, 0 ~ x - y - sin(t) }
  expect(function() sys:integrate { start = { x = 1 }, to = 1, method = "dopri5" } end):fails
    "which an explicit method needs; take method = \"radau\" or \"bdf\""
  expect(sys:integrate{ start = { x = 1 }, to = 1, method = "radau" }.status):equals "finished"
end)

test("methods() has every method once, of every family", function()
  local seen, families = {}, {}
  for _, method in ipairs(pendula.methods()) do
    expect(seen[method.name]):is_nil()
    seen[method.name], families[method.family] = true, true
  end
  for _, family in ipairs(method_families()) do expect(families[family.name]):is_true() end
end)
