-- The problems of bench/, whose end values were computed in quadruple precision: the default and the implicit
-- methods lose at most some digits of those asked for, the same number at every tolerance, or say why.
-- bench/digits.lua is the long version.
local list = assert(loadfile "bench/problems.lua")("bench/")

-- Errors at the start that the equations themselves make larger until the end, as powers of ten.
local amplified = { ["Kepler, e = 0.9"] = 5, ["three bodies, 3-4-5"] = 4.5, ["double pendulum"] = 4.5,
  Lorenz = 4.5, ["E5, t = 1e9"] = 3, ["Arenstorf orbit"] = 3, Pleiades = 3,
  ["Van der Pol, 30"] = 3, ["ring oscillator"] = 3.5,
  ["flexible crank, damped"] = 2.5 }                           -- b is a quarter of its amplitude at the end
local long = { ["ring modulator, index 2"] = true, ["ring modulator, 2 pF"] = true, ["heat, 50 × 50"] = true,
  ["Medical Akzo Nobel"] = true, ["beam of 40 pieces"] = true, ["Brusselator, 500 points"] = true }

local function worst(problem, sol)
  local error = 0
  for name, exact in pairs(problem.reference) do
    error = math.max(error, math.abs((sol:final(name) - exact)/exact))
  end
  return error
end

local count = 0
for _, problem in ipairs(list) do
  if problem.reference and problem.source and not long[problem.name] then
    count = count + 1
    test("digits: " .. problem.name, function()
      local model = problem.model(problem)
      local form = model:index() > 1 and model:reduce() or model
      for _, method in ipairs { "default", problem.stiff and "radau" or "dop853" } do
        for _, rtol in ipairs { 1e-6, 1e-10 } do
          local sol = form:integrate { start = problem.start, to = problem.to, rtol = rtol,
            atol = problem.atol and problem.atol(rtol) or rtol, times = { problem.to },
            method = method ~= "default" and method or nil }
          expect(sol.status):equals "finished"
          local lost = math.log(worst(problem, sol)/rtol, 10)
          if not (lost <= (amplified[problem.name] or 2)) and sol:stats().rounding == "" then
            expect(("%s, rtol = %g: %.1f digits lost"):format(method, rtol, lost)):equals "fewer"
          end
        end
      end
    end)
  end
end
test("all of them", function() expect(count >= 18):is_true() end)

test("digits that rounding errors of the equations take are announced", function()
  for _, problem in ipairs(list) do
    if ("E5, t = 1e9; HIRES; Robertson DAE, t = 4e7"):find(problem.name, 1, true) then
      local sol = problem.model(problem):integrate { start = problem.start, to = problem.to, rtol = 1e-10,
        atol = problem.atol(1e-10) }
      if problem.name:find "E5" then
        expect(sol:stats().rounding):matches "rounding errors of the equations leave y"
        expect(tostring(sol:stats())):matches "not as many digits"
        expect(worst(problem, sol) > 1e-6):is_true()
      else
        expect(sol:stats().rounding):equals ""
      end
    end
  end
end)

test("a step across the end of stiffness is not taken with the Jacobian from before it", function()
  local x, y = vars "x y"
  for _, c in ipairs { 1e4, 1e5, 1e7 } do
    local brake = dae { der(x) ~ y, der(y) ~ -x - c/2*(1 - tanh(15*(t - 1)))*y + sin(t/3) }
    local exact = brake:integrate { start = { x = 1, y = 0 }, to = 50, rtol = 1e-12, atol = 1e-12,
      method = "radau" }
    for _, rtol in ipairs { 1e-4, 1e-6 } do
      for _, scale in ipairs { 1, 1e3 } do
        local run = brake:integrate { start = { x = 1, y = 0 }, to = 50, rtol = rtol, atol = rtol/scale,
          method = "radau" }
        expect(run(x, 50)):near(exact(x, 50), 100*rtol)
      end
    end
  end
end)
