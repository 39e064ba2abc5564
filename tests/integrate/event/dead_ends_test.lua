-- Borders behind which no solution goes on: on each side the equations of that side lead to the other one.
local families = dofile "tests/families.lua"
local x, z = vars "x z"
local taken = dofile "tests/part_of.lua"(5)
local methods = families.with("auto", "dopri5")

test("a run ends where two branches of z end in a kink", function()
  for _, s in ipairs { 1, 1e-6, 1e6 } do
    local folds = {             -- equation, start: z = 0 at t = 1, no z behind
      { dae { der(x) ~ -1, z ~ 2*abs(z) - s*x }, { x = 1 }, s },
      { dae { der(x) ~ 1, max(z, -z/2) ~ s*(x^2 - 1) }, { x = -2 }, s },
      { dae { der(x) ~ 1, ifelse(gt(z, 0), 2*z, -z) ~ s*(1 - x) }, { x = 0 }, s },
    }
    for k, fold in ipairs(folds) do
      local at = fold[1]:init { fix = fold[2], guess = { z = fold[3] } }
      for _, method in ipairs(methods) do
        for _, rtol in ipairs { 1e-3, 1e-8 } do
          if taken() then
            local sol = fold[1]:integrate { start = at, to = 2, method = method, rtol = rtol }
            expect(k .. method .. sol.status):matches
              "stopped at t = 1: .* = 0 there, and the solutions .* both sides"
            expect(sol.t[#sol.t]):near(1, 1e-9)
          end
        end
      end
    end
  end
end)

test("a run goes on where z crosses the border, and where it dips below for a moment", function()
  for _, method in ipairs(methods) do
    local ways = dae { der(x) ~ 1, z + abs(z)/2 ~ (x - 1)^2 - 1e-6 }
    local sol = ways:integrate { start = { x = 0 }, to = 2, method = method, rtol = 1e-6 }
    expect(method .. sol.status):equals(method .. "finished")
    expect(sol(z, 2)):near((1 - 1e-6)/1.5, 1e-5)
  end
end)
