-- Starts beside poles, and transients: x′ at the start is as large as one likes and tells nothing about how
-- large x becomes, so that the default atol must not follow from it. Exact solutions.
local taken = dofile "tests/part_of.lua"(7)
local x, v, z = vars "x v z"

-- name, equations and start at the distance d, x(t)
local models = {
  { "1/x", function(d) return { der(x) ~ 1/x }, { x = d } end,
    function(t, d) return math.sqrt(d*d + 2*t) end },
  { "1/x²", function(d) return { der(x) ~ 1/x^2 }, { x = d } end,
    function(t, d) return (d^3 + 3*t)^(1/3) end },
  { "1/√x", function(d) return { der(x) ~ 1/sqrt(x) }, { x = d } end,
    function(t, d) return (d^1.5 + 1.5*t)^(2/3) end },
  { "0 = x z - 1", function(d) return { der(x) ~ z, 0 ~ x*z - 1 }, { x = d, z = 1/d } end,
    function(t, d) return math.sqrt(d*d + 2*t) end },
  { "x″ = 1/x³", function(d) return { der(x) ~ v, der(v) ~ 1/x^3 }, { x = d, v = 0 } end,
    function(t, d) return math.sqrt(d*d + t*t/(d*d)) end },
  { "-x³/d", function(d) return { der(x) ~ -x^3/d }, { x = 1 } end,
    function(t, d) return 1/math.sqrt(1 + 2*t/d) end },
  { "1/(t + d)", function(d) return { der(x) ~ 1/(t + d) }, { x = 0 } end,
    function(t, d) return math.log(t + d) - math.log(d) end },
  { "1/(t + d)²", function(d) return { der(x) ~ 1/(t + d)^2 }, { x = 0 } end,
    function(t, d) return 1/d - 1/(t + d) end },
}

-- The error in tolerances, the largest of four moments.
local function largest_error(sol, exact, d, rtol, to)
  local largest = 0
  for _, share in ipairs { 1e-3, 0.1, 0.5, 1 } do
    local value = exact(share*to, d)
    largest = math.max(largest, math.abs(sol(x, share*to) - value)/(rtol*(math.abs(value) + 1e-3)))
  end
  return largest
end

local cases = {}
for _, d in ipairs { 1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15 } do
  for _, method in ipairs { "auto", "dopri5", "dop853", "tsit5", "radau", "bdf", "rodas", "gauss" } do
    for _, rtol in ipairs { 1e-4, 1e-6 } do
      for _, to in ipairs { 10, 1000 } do cases[#cases + 1] = { d, method, rtol, to } end
    end
  end
end

test("starts beside poles: no method finishes with another solution", function()
  local finished, runs = 0, 0
  for _, model in ipairs(models) do
    local name, make, exact = table.unpack(model)
    for _, case in ipairs(cases) do
      if taken() then
        local d, method, rtol, to = table.unpack(case)
        local equations, start = make(d)
        local sol = dae(equations):integrate { start = start, to = to, rtol = rtol, method = method }
        runs = runs + 1
        if sol.status == "finished" then
          finished = finished + 1
          local off = largest_error(sol, exact, d, rtol, to)
          if not (off < 100) and not tostring(sol):find("sol:check() estimates", 1, true) then
            error(("%s, d = %g, %s, rtol %g, to %g: %g tolerances"):format(name, d, method, rtol, to, off), 0)
          end
        end
      end
    end
  end
  expect(finished > 0.95*runs):is_true()
end)
