-- Branches of an algebraic equation that cross or touch: no run passes them on a branch of its own choice.
local families = dofile "tests/families.lua"
local x, y, z, v = vars "x y z v"
local part_of = dofile "tests/part_of.lua"
local methods = families.with("auto", "dopri5", "dop853", "tsit5", "verner76")

local function runs(equations, fix, guess, to, check)
  local sys = dae(equations)
  local at, taken = sys:init { fix = fix, guess = guess }, part_of(2)
  for _, method in ipairs(methods) do
    for _, rtol in ipairs { 1e-3, 1e-4, 1e-5, 1e-7, 1e-9 } do
      if taken() then
        local sol = sys:integrate { start = at, to = to, rtol = rtol, method = method }
        check(sol, method .. " " .. rtol .. ": ", rtol)
      end
    end
  end
end

local function stops_at(exact, within)
  return function(sol, who, rtol)
    expect(who .. sol.status):matches "stopped at t = "
    if rtol <= 1e-5 then expect(tonumber(sol.status:match "t = ([^:]*):")):near(exact, within) end
  end
end
local function finishes(e, exact)
  return function(sol, who, rtol)
    if rtol > 1e-6 and sol.status ~= "finished" then return end  -- gives up near the branch it must not take
    expect(who .. sol.status):equals(who .. "finished")
    expect(sol:final(e)):near(exact, 2e-2)
  end
end

test("branches that cross", function()
  runs({ der(x) ~ 1, 0 ~ z^2 - x^2 }, { x = -1 }, { z = -1 }, 2, stops_at(1, 0.03))
  runs({ der(x) ~ 1, 0 ~ z^2 - x^2 }, { x = -0.77 }, { z = 0.8 }, 2, stops_at(0.77, 0.03))
  runs({ der(x) ~ 1, 0 ~ z^2 - sin(x)^2 }, { x = -1 }, { z = -0.8 }, 2, stops_at(1, 0.03))
  runs({ der(x) ~ 1e3, 0 ~ z^2 - 1e-4*x^2 }, { x = -1 }, { z = -1e-2 }, 2e-3, stops_at(1e-3, 3e-5))
  runs({ der(x) ~ 1, der(y) ~ z, 0 ~ (z - x)*(z - x^3 + 0.5) }, { x = -1, y = 0 }, { z = -1 }, 4,
    function(sol, who, rtol)
      if not who:find "^bdf" then stops_at(2.19148788395, 0.2)(sol, who, rtol) end
    end)
end)

test("branches that touch", function()
  runs({ der(x) ~ 1, 0 ~ z^2*(1 + x^2) - x^4 }, { x = -1 }, { z = 0.7 }, 2, stops_at(1, 0.2))
end)

test("branches that come near each other and do not meet", function()
  for _, gap in ipairs { 0.1, 1e-2, 1e-3, 1e-4, 1e-5 } do
    runs({ der(x) ~ 1, 0 ~ z^2 - x^2 - gap }, { x = -1 }, { z = -1 }, 2, finishes(z, -math.sqrt(1 + gap)))
  end
  runs({ der(x) ~ v, der(v) ~ -x, 0 ~ z^2 - x^2 - 0.04 }, { x = 1, v = 0 }, { z = 1 }, 4*math.pi,
    finishes(z, math.sqrt(1.04)))
end)

-- Steps as long as the distance between two crossings: their ends do not show that z has turned in between.
test("branches that cross inside long steps, right at the start or before the end", function()
  local sys = dae { der(x) ~ 1, 0 ~ z^2 - sin(x)^2 }
  for _, method in ipairs { "dopri5", "tsit5", "verner98" } do
    for _, d in ipairs { 0.001, 1 } do
      for _, to in ipairs { 1, 5 } do
        for _, rtol in ipairs { 1e-4, 1e-9 } do
          local sol = sys:integrate { start = { x = d, z = math.sin(d) }, to = math.pi - d + to, rtol = rtol,
            method = method }
          expect(("%s %g %g: %s"):format(method, d, to, sol.status)):matches "stopped at t = "
          expect(sol(x):slice(#sol.t, #sol.t)[1] < math.pi + 0.01):equals(true)
        end
      end
    end
  end
  local at = math.pi + 0.001                             -- steps shrink to the rounding of t there
  local sol = sys:integrate { start = { x = at, z = math.sin(at) }, to = math.pi + 2, rtol = 1e-9,
    method = "verner98" }
  expect(sol.status):matches "stopped at t = 3%.14"
end)

test("starts beside a crossing stop there, as close as they may be", function()
  local crossing = {
    { dae { der(x) ~ 1, 0 ~ z^2 - sin(x)^2 }, math.sin },
    { dae { der(x) ~ 1, 0 ~ z^2 - x^2 }, function(at) return at end },
    { dae { der(x) ~ 1, 0 ~ z^3 - x^2*z }, function(at) return at end },
  }
  local taken = part_of(7)
  for k, case in ipairs(crossing) do
    for _, method in ipairs { "auto", "verner98", "dopri5", "radau", "bdf" } do
      for _, at in ipairs { -1e-6, -1e-8, -1e-9, -3e-10, -1e-10, -1e-11 } do
        for _, rtol in ipairs { 1e-6, 1e-9 } do
          if taken() then
            local sol = case[1]:integrate { start = { x = at, z = case[2](at) }, to = 1, rtol = rtol,
              method = method }
            local who = ("%d, %s, %g, %g: "):format(k, method, at, rtol)
            expect(who .. sol.status):matches "stopped at t = .*no longer determines? z"
            expect(sol.t[#sol.t] < 2*math.abs(at) + 1e-9):is_true()
          end
        end
      end
    end
  end
end)

-- Runs that stop before the point, by steps that fail, name the ways on from there as those that reach it do.
test("every run beside a crossing names both ways on", function()
  local function root(factor) return function(at) return at*math.sqrt(factor(at)) end end
  local crossing = {
    { dae { der(x) ~ 1, 0 ~ z^2 - x^2 }, function(at) return at end },
    { dae { der(x) ~ 1, 0 ~ z^2 - sin(x)^2 }, math.sin },
    { dae { der(x) ~ 1, 0 ~ z^3 - x^2*z }, function(at) return at end },
    { dae { der(x) ~ 1, 0 ~ z^2 - x^2*(2 + x) }, root(function(at) return 2 + at end) },
    { dae { der(x) ~ 1, 0 ~ z^2 - x^4 - x^2 }, root(function(at) return 1 + at^2 end) },
  }
  local taken = part_of(3)
  for k, case in ipairs(crossing) do
    for _, method in ipairs { "auto", "radau", "bdf", "rodas", "dopri5", "tsit5", "verner76" } do
      for _, at in ipairs { -1, -0.77, -0.1, -1e-3 } do
        for _, rtol in ipairs { 1e-3, 1e-4, 1e-6, 1e-9 } do
          if taken() then
            local sol = case[1]:integrate { start = { x = at, z = case[2](at) }, to = 2, rtol = rtol,
              method = method }
            expect(("%d, %s, %g, %g: %s"):format(k, method, at, rtol, sol.status)):matches(
              "stopped at t = .*solutions go on .* with z′ = .* or z′ = .*branch = ")
          end
        end
      end
    end
  end
end)
