-- Starts from values that are small beside the units which the equations seem to have: z follows from x to
-- full accuracy.
local x, z = vars "x z"

--- The root of f near w by Newton's method, in plain numbers.
local function root(f, slope, w)
  for _ = 1, 200 do w = w - f(w)/slope(w) end
  return w
end

-- The equation for z, 0 = …, with a factor s, and its solution; the largest s x.
local equations = {
  { function(s) return sqrt(z) + z*s/1000 - x end,
    function(a, s) return (2*a/(1 + math.sqrt(1 + 4*a*s/1000)))^2 end },
  { function(s) return z^2*s + z - x end, function(a, s) return 2*a/(1 + math.sqrt(1 + 4*a*s)) end },
  { function(s) return z^3*s + z - x end, function(a, s)
    return root(function(w) return w^3*s + w - a end, function(w) return 3*w^2*s + 1 end, a)
  end },
  { function(s) return z*(1 + z*s) - x^2 end, function(a, s) return 2*a*a/(1 + math.sqrt(1 + 4*a*a*s)) end },
  { function(s) return z/(1 + z*s) - x end, function(a, s) return a/(1 - a*s) end, 0.01 },
}

for k, equation in ipairs(equations) do
  test(("z follows from x of 1e-14 … 1e6, equation %d"):format(k), function()
    local f, exact, largest = table.unpack(equation)
    for _, s in ipairs { 1e-6, 1, 1e6 } do
      local model = dae { der(x) ~ -x, f(s) ~ 0 }
      for power = -14, 6 do
        local a = 1.7*10^power
        if a*s <= (largest or math.huge) then
          local start = model:init { fix = { x = a } }
          expect(start(x)):equals(a)
          expect(start(der(x))):near(-a, 1e-15*a)
          expect(start(z)):near(exact(a, s), 1e-9*exact(a, s))
        end
      end
    end
  end)
end

test("a run that begins with one of two roots names the other", function()
  local a, z = vars "a z"
  local sys = dae { der(a)^2 ~ 4*a }
  local function said(sol) return tostring(sol):match "begins with one of several roots[^\n]*" end
  local sol = sys:integrate { start = { a = 1 }, to = 0.5 }
  local way = "a′ = ±√(4 a): here 2; -2 by start = sys:init{ fix = { … }, guess = { [a.dot] = -2 } }"
  expect(said(sol):find(way, 1, true) ~= nil):is_true()
  local falling = sys:integrate { start = sys:init { fix = { a = 1 }, guess = { [a.dot] = -2 } }, to = 0.5 }
  expect(said(falling)):equals(nil)
  expect(falling:final(a)):near(0.25, 1e-5)
  expect(said(dae { der(a) ~ -z, 0 ~ z^2 - a } :integrate { start = { a = 1 }, to = 0.5 })):matches "z = ±√"
  expect(said(dae { der(a) ~ -a^2 } :integrate { start = { a = 1 }, to = 0.5 })):equals(nil)
end)
