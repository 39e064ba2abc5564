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
