-- Switches 1/(1 + exp(-k u)) so steep that the exponential overflows on one side: its derivative is ∞/∞
-- there as it stands (docs/derivations.md#exponentials-that-overflow).
local families = dofile "tests/families.lua"
local x, v = vars "x v"

local function end_of(equations, unknown, to, method)
  local start = { [x] = 0 }
  if #equations > 1 and unknown == x then start[v] = 0 end
  local sol = dae(equations):integrate { start = start, to = to, method = method, rtol = 1e-7 }
  expect(sol.status):equals "finished"
  return sol:final(unknown)
end

local methods = families.with("auto", "rodas5p", "dopri5", "dop853", "verner87")
for _, method in ipairs(methods) do
  test("steep logistic functions by " .. method, function()
    for _, k in ipairs { 40, 720, 1500, 1e5 } do
      -- u = k(t - 1): x(2) - x(0) = (log(1 + eᵏ) - log(1 + e⁻ᵏ))/k = 1.
      local by_time = { der(x) ~ 1/(1 + exp(-k*(t - 1))) }
      expect(end_of(by_time, x, 2, method)):near(1, 3e-5)
      -- u = k(x - 1): t = (u - log(1 + 2 eᵘ)/2)/k + c, from x = 0 to 2 in 3/2 - log(2)/(2 k).
      local by_state = { der(x) ~ 1 + 1/(1 + exp(-k*(x - 1))) }
      expect(end_of(by_state, x, 1.5 - math.log(2)/(2*k), method)):near(2, 3e-5)
    end
  end)
end

for _, method in ipairs { "auto", "rodas5p", "radau", "bdf" } do
  test("beside a stiff part, v 10⁻⁵ behind x, by " .. method, function()
    local switched = { der(x) ~ 1/(1 + exp(-2000*(t - 1))), der(v) ~ -1e5*(v - x) }
    expect(end_of(switched, x, 2, method)):near(1, 3e-5)
  end)
  test("a soliton from where its cosh overflows, by " .. method, function()
    expect(end_of({ der(x) ~ 1, v ~ 1/cosh(x - 900)^2 }, v, 900, method)):near(1, 1e-5)
  end)
end
