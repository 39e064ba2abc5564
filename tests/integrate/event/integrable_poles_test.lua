-- Poles that have an area, |c|^(-q) with q < 1, and zeros of divisors that no solution crosses: a run is
-- within its tolerances there, or says that it is not. Exact solutions, any method, any unit.
local families = dofile "tests/families.lua"
local speaks = dofile "tests/speaks.lua"
local part_of = dofile "tests/part_of.lua"
local b, c, x = vars "b c x"
local methods = families.with("auto", "dopri5", "dop853", "tsit5")
local taken = part_of(7)

-- Every method and tolerance: the value of `unknown` at `to` is right within `most` tolerances, or the run
-- speaks.
local function is_right_or_speaks(equations, options, unknown, exact, most)
  local finished = 0
  for _, method in ipairs(methods) do
    for _, rtol in ipairs { 1e-3, 1e-4, 1e-5, 1e-6, 1e-8 } do
      if taken() then
        options.method, options.rtol = method, rtol
        local sol = dae(equations):integrate(options)
        if sol.status == "finished" then finished = finished + 1 end
        if not speaks(sol) then
          expect(sol(unknown, options.to)):near(exact, most*rtol*math.abs(exact))
        end
      end
    end
  end
  return finished
end

local powers = { { 1/4, abs(c)^(-1/4) }, { 1/3, (c^2)^(-1/6) }, { 1/2, 1/sqrt(abs(c)) },
  { 1/2, (c^2)^(-1/4) }, { 2/3, abs(c)^(-2/3) } }
for i, power in ipairs(powers) do
  local q, pole = power[1], power[2]
  test(("the area of %s, passed at c = 0"):format(pole), function()
    for _, unit in ipairs { 1, 1e-6, 1e6 } do
      -- c from -1 to 1 unit: b = ∫ |c|^(-q) dt
      local exact = 2/(1 - q)*unit^(-q)
      local finished = is_right_or_speaks({ der(b) ~ pole, der(c) ~ unit },
        { start = { b = 0, c = -unit }, to = 2 }, b, exact, 200)
      expect(finished > 0):is_true()
    end
  end)
  test(("the area of %s, with a speed that changes"):format(pole), function()
    -- c = s + s²/4, s = t - 0.7; substituting c: b = ∫ |c|^(-q) c′ dt has its antiderivative
    local c0, c1 = -0.7 + 0.49/4, 1 + 1/4
    local exact = (c1^(1 - q) + (-c0)^(1 - q))/(1 - q)
    is_right_or_speaks({ der(b) ~ pole*(1 + (t - 0.7)/2), der(c) ~ 1 + (t - 0.7)/2 },
      { start = { b = 0, c = c0 }, to = 1.7 }, b, exact, 200)
  end)
end

test("what stops at an integrable pole names what the user has written", function()
  for _, method in ipairs(methods) do
    local sol = dae { der(b) ~ 1/sqrt(abs(c)), der(c) ~ 1 }
      :integrate { start = { b = 0, c = -1 }, to = 2, rtol = 1e-9, method = method }
    expect(sol.status:find("mode", 1, true)):equals(nil)
    expect(sol.status:find("e-308", 1, true)):equals(nil)
  end
end)

-- x′ = -x²/(ε² + x²): x - ε²/x = 1 - ε² - t. Behind t = 1 x is about ε²/(t - 1), and never below 0.
for _, epsilon in ipairs { 1e-2, 1e-3, 1e-4, 1e-6 } do
  for _, unit in ipairs { 1, 1e-6, 1e3 } do
    test(("no step passes x = 0, at rest there within %g, in units of %g"):format(epsilon, unit), function()
      local s = 1 - epsilon^2 - 2
      local exact = (s + math.sqrt(s^2 + 4*epsilon^2))/2*unit
      for _, method in ipairs(methods) do
        for _, rtol in ipairs { 1e-3, 1e-4, 1e-5, 1e-6, 1e-8 } do
          if taken() then
            local sol = dae { der(x) ~ -unit/((epsilon*unit)^2/x^2 + 1) }
              :integrate { start = { x = unit }, to = 2, rtol = rtol, method = method }
            if not speaks(sol) then expect(sol(x, 2)):near(exact, 100*rtol*unit) end
          end
        end
      end
    end)
  end
end

-- x′ = -(1 - p), p a peak of height 1 and width ε at x = 0. There x > 0 is within 10 ε from t = 1.1 on.
local function peaks(u)
  return { exp(-u^2), 1 - tanh(u^2), 1 - tanh(u)^2, 1/cosh(u), 1/(1 + u^4), exp(-u^2)*(1 + u/50) }
end
for i = 1, #peaks(x) do
  test(("no step passes x = 0, at rest there within the peak %s"):format(peaks(x)[i]), function()
    for _, epsilon in ipairs { 1e-2, 1e-3, 1e-4 } do
      for _, method in ipairs(methods) do
        for _, rtol in ipairs { 1e-3, 1e-4, 1e-6 } do
          -- an error within a tolerance that is wider than the peak leads to the other side
          if rtol < epsilon and taken() then
            local sol = dae { der(x) ~ peaks(x/epsilon)[i] - 1 }
              :integrate { start = { x = 1 }, to = 2, rtol = rtol, method = method }
            if not speaks(sol) then expect(sol(x, 2)):near(0, 100*rtol + 10*epsilon) end
          end
        end
      end
    end
  end)
end

test("what decays below the tolerance says so only where it has changed its sign", function()
  for _, method in ipairs(methods) do
    local sol = dae { der(x) ~ -x, der(b) ~ 1/(1 + 1/x^2) }
      :integrate { start = { x = 1, b = 0 }, to = 3, method = method }
    expect(sol:stats().not_unique):equals ""
  end
end)

test("divisors that solutions cross are no barriers", function()
  for _, method in ipairs(methods) do
    for _, equation in ipairs { der(x) ~ 1, der(x) ~ 0.01 + (t - 1)^2, der(x) ~ cos(t - 1) } do
      local sol = dae { equation, der(b) ~ sin(x)/x + 1/(1 + 1e-4/x^2) }
        :integrate { start = { x = -1, b = 0 }, to = 4, rtol = 1e-6, method = method }
      expect(sol.status):equals "finished"
      expect(sol:stats().not_unique):equals ""
    end
  end
end)
