-- Where stiffness ends within a step, the matrix at its beginning is far too large: corrections and error
-- estimates are tiny then, whatever the step does. No method may take such a step for a good one.
local families = dofile "tests/families.lua"
local x, y, z, s = vars "x y z s"
local c, w = params "c=1e5 w=15"
local brakes = {
  ["released at t = 1"] = { der(x) ~ y, der(y) ~ -x - c/2*(1 - tanh(w*(t - 1)))*y + sin(t/3) },
  ["worn away"] = { der(x) ~ y, der(y) ~ -x - c*exp(-w*max(0, t - 1)^2)*y + sin(t/3) },
  ["released by a state"] = { der(s) ~ 1, der(x) ~ y,
    der(y) ~ -x - c/2*(1 - tanh(w*(s - 1)))*y + sin(t/3) },
  ["with an algebraic force"] = { der(x) ~ y, der(y) ~ -x - z + sin(t/3),
    0 ~ z - c/2*(1 - tanh(w*(t - 1)))*y },
}
local methods = families.with("auto", "rodas3")

for name, equations in pairs(brakes) do
  test("a brake " .. name, function()
    local brake = dae(equations)
    local start = { x = 1, y = 0, s = name:find "state" and 0 or nil }
    for _, numbers in ipairs { { c = 1e3, w = 15 }, { c = 1e5, w = 5 }, { c = 1e7, w = 15 } } do
      local function run(rtol, method)
        return brake:integrate { start = start, to = 30, params = numbers, rtol = rtol, atol = rtol,
          method = method }
      end
      local exact = run(1e-11, "radau")
      for _, method in ipairs(methods) do
        for _, rtol in ipairs { 1e-4, 1e-5, 1e-7 } do
          local sol = run(rtol, method)
          expect(sol.status):equals "finished"
          local error = math.abs(sol:final(x) - exact:final(x))
          if not (error < 100*rtol) then
            local where = ("%s, c = %g, w = %g"):format(method, numbers.c, numbers.w)
            expect(("%s, rtol = %g: error %.1e"):format(where, rtol, error)):equals "smaller"
          end
        end
      end
    end
  end)
end
