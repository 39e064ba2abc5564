-- Obstacles narrower than a step, functions of x and of z: a run follows them within its tolerances, or says
-- that it does not. Where x′ = 0 at x = 0 no solution crosses; a wall throws a particle back or slows it
-- down.
local families = dofile "tests/families.lua"
local speaks = dofile "tests/speaks.lua"
local x, v, z = vars "x v z"
local methods = families.with("auto", "dopri5", "dop853", "tsit5")

local function each_run(sys, options, tolerances, judge)
  for _, method in ipairs(methods) do
    for _, rtol in ipairs(tolerances) do
      options.method, options.rtol = method, rtol
      local sol = sys:integrate(options)
      if not speaks(sol) then judge(sol, rtol) end
    end
  end
end

-- x′ = -z with z = 0 at x = 0 only, and 1 beyond a few ε
local function obstacles(e)
  return { 0 ~ z - x^2/(e^2 + x^2), 0 ~ z*(e^2 + x^2) - x^2, 0 ~ z - (1 - exp(-(x/e)^2)),
    0 ~ z - tanh((x/e)^2), 0 ~ z + z^3/9 - 10/9*(1 - exp(-(x/e)^4)) }
end
for i, first in ipairs(obstacles(1e-2)) do
  test(("no step passes x = 0 where %s"):format(first), function()
    for _, epsilon in ipairs { 1e-2, 1e-3 } do
      local sys = dae { der(x) ~ -z, obstacles(epsilon)[i] }
      each_run(sys, { start = { x = 1 }, to = 2 }, { 1e-4, 1e-5, 1e-6 }, function(sol, rtol)
        expect(sol(x, 2)):near(0, 100*rtol + 10*epsilon)
      end)
    end
  end)
end

-- v′ = -dV/dx, V = K e^{-(x/ε)²}: v²/2 + V = ½. Below K = ½ the particle passes, above it returns.
for _, K in ipairs { 0.3, 0.8 } do
  for _, unit in ipairs { 1, 1e-6, 1e4 } do
    test(("a wall of height %g, in units of %g"):format(K, unit), function()
      for _, epsilon in ipairs { 1e-2, 1e-3 } do
        local e = epsilon*unit
        local force = K*2*unit^2*x/e^2*exp(-(x/e)^2)
        local forms = { { der(x) ~ v, der(v) ~ force }, { der(x) ~ v, der(v) ~ z, 0 ~ z - force } }
        for _, equations in ipairs(forms) do
          each_run(dae(equations), { start = { x = unit, v = -unit }, to = 2 }, { 1e-3, 1e-4, 1e-6 },
            function(sol, rtol)
              expect(sol(v, 2)/unit):near(K < 0.5 and -1 or 1, 200*rtol)
              expect(sol(x, 2)/unit):near(K < 0.5 and -1 or 1, 200*rtol + 10*epsilon)
            end)
        end
      end
    end)
  end
end

-- Where nothing is narrow there is nothing to say.
test("wide obstacles cost no steps", function()
  for _, method in ipairs(methods) do
    local plain = dae { der(x) ~ -x, 0 ~ z - x }:integrate { start = { x = 1 }, to = 3, method = method }
    local watched = dae { der(x) ~ -x/(1 + exp(-(x - 50)^2)), 0 ~ z - x }
      :integrate { start = { x = 1 }, to = 3, method = method }
    expect(watched:stats().steps):equals(plain:stats().steps)
  end
end)
