-- No run may call itself finished behind a pole or outside a domain: families of problems with known fates,
-- at every scale, tolerance and method.
local x = var "x"
local a = param "a=1"
local seed = 1
local function random()                                        -- the same numbers for every method
  seed = (1103515245*seed + 12345) % 2147483648
  return seed/2147483648
end
local tolerances = { 1e-3, 1e-5, 1e-6, 1e-8 }

local function every_method(name, model, request, is_wrong, but)
  for _, method in ipairs(methods()) do
    if not (but or {})[method.name] then
      test(("%s: %s"):format(name, method.name), function()
        seed = 12345
        for i = 1, 24 do
          local options = request()
          options.method, options.rtol, options.max_steps = method.name, tolerances[i % 4 + 1], 5000
          local sol = model:integrate(options)
          if is_wrong(sol, options) then
            local numbers = { options.start.x, options.params.a, options.rtol }
            local start = ("x = %.17g, a = %.17g, rtol = %g"):format(table.unpack(numbers))
            expect(("%s: %s with x = %g"):format(start, sol.status, sol:final(x))):equals "stopped"
          end
        end
      end)
    end
  end
end
local function finished(sol) return sol.status == "finished" end

-- x² = x₀² - 2at ends at t = x₀²/2a. Where the tolerance is larger than x, x may end on the other side.
every_method("x' = -a/x", dae { der(x) ~ -a/x }, function()
  local size = 10^(6*random() - 3)
  return { start = { x = size*(0.1 + random()) }, params = { a = size^2*(0.1 + random()) }, to = 2*5.1 }
end, function(sol, options)
  return math.abs(sol:final(x)) > 10*options.start.x
end)

-- x′ ≥ -at, so that x ≥ x₀ - at²/2; the slope of √|x| is infinite where it begins.
every_method("x' = 2√|x| - at", dae { der(x) ~ 2*sqrt(abs(x)) - a*t }, function()
  return { start = { x = 10^(-14*random() - 1) }, params = { a = 0.5 + random() }, to = 1 + 4*random() }
end, function(sol, options) return sol:final(x) < -options.params.a*options.to^2/2*1.001 end)

every_method("x' = a (acos x + 0.1)", dae { der(x) ~ a*(acos(x) + 0.1) }, function()
  return { start = { x = -0.9*random() }, params = { a = 10^(2*random() - 1) }, to = 100 }
end, finished)

every_method("x' = -a (√x + 0.1)", dae { der(x) ~ -a*(sqrt(x) + 0.1) }, function()
  return { start = { x = 0.1 + random() }, params = { a = 10^(2*random() - 1) }, to = 100 }
end, finished)

every_method("x' = ax²", dae { der(x) ~ a*x^2 }, function()
  return { start = { x = 0.1 + random() }, params = { a = 10^(2*random() - 1) }, to = 200 }
end, finished, { rodas3 = true })                              -- its third order steps over a pole

-- The estimate of ROS3P is zero for linear equations: it must not choose steps.
test("an error estimate that is blind for linear equations chooses no steps", function()
  local decay = dae { der(x) ~ -2*x }
  local options = { start = { x = 1 }, to = 2, rtol = 1e-8, method = rosenbrock.ros3p }
  expect(function() decay:integrate(options) end):fails "no embedded method"
end)
