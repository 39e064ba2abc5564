-- Unknowns that stand inside a sign or a condition: the slope of these is 0, so that a linear solve for the
-- unknown drops them, sign(w) as sign(0). Forms "ode", "project" (which reduce() takes) and "minimal" had
-- wrong equations then, without a word.
local x, y, u, v, la, w, s = vars "x y u v la w s"

-- Two masses that a rod couples, one on a belt of speed V. They stick until k x = mu, at t1 = mu/(k V), and
-- then swing about mu/k with the speed V at its centre, which touches that of the belt once in a period.
local mu, V, k = 2.5, 0.7, 12
local t1, om = mu/(k*V), math.sqrt(k/2)
local function exact(at) return at <= t1 and V*at or mu/k + V/om*math.sin(om*(at - t1)) end

local laws = {
  sign = { { w ~ u - V }, sign(w) },
  condition = { { w ~ u - V }, ifelse(lt(w, 0), -1, 1) },
  ["a chain of sensors"] = { { w ~ 3*s, s ~ 2*u - 2*V }, sign(w) },
}

for name, law in pairs(laws) do
  test("a belt, friction by " .. name .. ", in every form", function()
    local list = { der(x) ~ u, der(y) ~ v, der(u) ~ la - k*x - mu*law[2], der(v) ~ -la, 0 ~ x - y }
    for _, equation in ipairs(law[1]) do list[#list + 1] = equation end
    local belt = dae(list)
    for _, form in ipairs { "project", "ode", "minimal", "acc", "ggl", "dummy", "array" } do
      local low = belt:reduce(form)
      local at = belt:init { fix = { [x] = 0, [u] = V }, guess = { [y] = 0 } }
      local sol = low:integrate { start = at, to = 2.5, rtol = 1e-8, method = "radau" }
      expect(form .. " " .. sol.status):equals(form .. " finished")
      for i = 1, 5 do expect(sol(x, i/2)):near(exact(i/2), 1e-6) end
    end
  end)
end

test("equations that such an unknown makes nonlinear are not solved by a linear solve", function()
  local model = dae { der(x) ~ -w, 0 ~ w + sign(w) - x }
  expect(function() return model:reduce("ode") end):fails "is not linear in w"
  model = dae { der(x) + sign(der(x)) ~ -x }
  expect(function() return model:reduce("ode") end):fails "is not linear in x′"
end)
