-- Peaks of the solution's own functions that lie between two stages: e^{-(x - a)²/w²}, 1/(w² + (x - a)²).
local x, y = vars "x y"
local methods = { "auto", "dopri5", "tsit5", "dop853", "radau", "rodas", "bdf", "gauss" }

-- x is t, but a state; y answers to the peak.
local function worst(peak, exact, widths)
  local most, where = 0, ""
  for _, method in ipairs(methods) do
    for _, w in ipairs(widths) do
      for i = 1, 6 do
        local a, rtol = 1.7 + 1.13*i, 1e-6
        local sol = dae { der(x) ~ 1, der(y) ~ peak(x - a, w) - y }:integrate { start = { x = 0, y = 1 },
          to = 10, rtol = rtol, method = method ~= "auto" and method or nil }
        local value = exact(a, w)
        local off = math.abs(sol(y, 10) - value)/(rtol*(math.abs(value) + 1e-3))
        if off > most then
          most, where = off, ("%s, w = %g, a = %g: off by %g tolerances"):format(method, w, a, off)
        end
      end
    end
  end
  return most, where
end

test("no method passes over a bell curve of the solution", function()
  -- ∫ e^{-(10 - s)} e^{-((s - a)/w)²} ds = w √π e^{-(10 - a) + w²/4}, less what lies outside of the interval
  local function exact(a, w) return math.exp(-10) + w*math.sqrt(math.pi)*math.exp(a - 10 + w*w/4) end
  local most, where = worst(function(d, w) return exp(-(d/w)^2) end, exact, { 0.1, 0.01, 0.001 })
  if most > 100 then error(where, 0) end
end)

test("two peaks in one step", function()
  local a, b, c = vars "a b c"
  local model = dae { der(a) ~ cos(t)*exp(-sin(c)^2), der(b) ~ exp(-0.04*a^2*(5*a + 3)^2/c^2) - 13*b,
    der(c) ~ -c }
  local start, to = { a = -1/30, b = -1, c = 1 }, 10
  local tight = model:integrate { start = start, to = to, rtol = 1e-9, dtmax = 1e-3 }
  for _, method in ipairs { "dop853", "radau", "tsit5" } do
    local sol = model:integrate { start = start, to = to, rtol = 1e-6, method = method }
    for at = 1, 10 do
      local value = tight(b, at)
      expect(math.abs(sol(b, at) - value) <= 1e-4*(math.abs(value) + 1e-3)):equals(true)
    end
  end
end)

test("runs without peaks take the steps they took", function()
  -- an exponent that varies, and has no maximum far above the ends of a step
  local sol = dae { der(x) ~ -x*exp(-x^2), der(y) ~ exp(-x) - y }
    :integrate { start = { x = 1, y = 0 }, to = 20, method = "dopri5" }
  expect(sol:stats().rejected <= 2):equals(true)
end)
