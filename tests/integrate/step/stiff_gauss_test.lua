-- Gauss's methods keep the errors of stiff components, R(∞) = ±1: no estimate from the stages of one step
-- sees their sum. x′ = -λ (x - sin t) + cos t has the solution sin t for every λ (Prothero & Robinson 1974).
local x = var "x"

test("gauss on stiff equations stays within its tolerance", function()
  -- A step may be off by forty tolerances where the order is that of the stages (prepare_tolerances), and so
  -- may the distance from the slow solution; what is not stiff adds a few.
  local most = 50
  for _, stiffness in ipairs { 1e2, 1e4, 1e5, 1e6 } do
    local model = dae { der(x) ~ -stiffness*(x - sin(t)) + cos(t) }
    for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
      for to = 1, 10 do
        local sol = model:integrate { start = { x = 0 }, to = to, rtol = rtol, method = "gauss" }
        local off = math.abs(sol(x, to) - math.sin(to))/(rtol*(math.abs(math.sin(to)) + 1e-3))
        if not (off <= most) then
          error(("stiffness %g, rtol %g, to %d: off by %g tolerances"):format(stiffness, rtol, to, off), 0)
        end
        expect(sol:stats().steps < 300):equals(true)  -- up to 236 before the errors were seen
      end
    end
  end
end)

test("gauss on a stiff equation that is implicit in x′, and of index 1", function()
  local z, y = var "z", var "y"
  for _, rtol in ipairs { 1e-5, 1e-7 } do
    local sol = dae { 2*der(x) + 1e5*z ~ 2*cos(t), 0 ~ z - 2*x + 2*sin(t), der(y) ~ z - y }
      :integrate { start = { x = 0, y = 0 }, to = 5, rtol = rtol, method = "gauss" }
    expect(math.abs(sol(x, 5) - math.sin(5)) <= 50*rtol):equals(true)
    expect(math.abs(sol(y, 5)) <= 100*rtol):equals(true)
  end
end)

-- Robertson's problem: a ≈ 1/(4.8e-4 t) decays to an equilibrium that grows away on its other side. An
-- error δ of b, kept from step to step with its sign changing, takes 3e7 δ² of a: with atol = 3e-12 that is
-- a thousand times a at the end.
test("gauss does not keep errors below the tolerance that the equations add up", function()
  local a, b, c = vars "a b c"
  local model = dae { der(a) ~ -0.04*a + 1e4*b*c, der(b) ~ 0.04*a - 1e4*b*c - 3e7*b^2,
    der(c) ~ 3e7*b^2 }
  local start = { a = 1, b = 0, c = 0 }
  local exact = 2.08334015e-8  -- radau at rtol = 1e-9, and at 1e-11
  for _, rtol in ipairs { 1e-2, 3.16e-4, 1e-5 } do
    local sol = model:integrate { start = start, to = 1e11, method = "gauss", rtol = rtol, atol = 1e-8*rtol }
    expect(sol.status):equals "finished"
    expect(math.abs(sol(a, 1e11)/exact - 1) < 50*rtol):is_true()
    expect(sol:stats().steps < 300):is_true()
    expect(math.abs(sol(a, 1e11) + sol(b, 1e11) + sol(c, 1e11) - 1) < 1e-12):is_true()
  end
end)

-- What is not stiff keeps the order of the method: van der Pol's equation, μ = 1000.
test("gauss gives up stiff errors only", function()
  local v = var "v"
  local model = dae { der(x) ~ v, der(v) ~ 1e3*(1 - x^2)*v - x }
  local start = { x = 2, v = 0 }
  local exact = model:integrate { start = start, to = 1500, rtol = 1e-11, atol = 1e-13, method = "radau" }
  for _, rtol in ipairs { 1e-4, 1e-6, 1e-8 } do
    local sol = model:integrate { start = start, to = 1500, method = "gauss", rtol = rtol, atol = 1e-3*rtol }
    -- up to 85 times rtol if all of the error moves
    expect(math.abs(sol(x, 1500) - exact(x, 1500)) < rtol):is_true()
  end
end)
