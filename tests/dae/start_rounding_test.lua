-- Equations hold at a start to rounding, not to ten digits: what only nearly holds is refused.
local x, y, z, w = vars "x y z w"
local units = { 1e-9, 1, 1e6 }

-- y = x leaves 0 = w, w = 1; z (x - y) = -k would need z = k/10⁻¹⁰ where x - y is 10⁻¹⁰.
test("equations that have no solution but one at infinity", function()
  for _, unit in ipairs(units) do
    for _, k in ipairs { 1e-9, 1e-6, 1e-3 } do
      local X, Y = x/unit, y/unit
      local sys = dae { der(x) ~ -x, 0 ~ Y^3 + Y - X^3 - X, 0 ~ (X - Y)*z/k + w, 0 ~ w - 1 + z*(X - Y) }
      expect(function() sys:init { fix = { x = unit/3 } } end):fails "init"
      local near = dae { der(x) ~ -x, 0 ~ Y^3 + Y - X^3 - X, 0 ~ (X - Y + 1e-6)*z/k + w,
        0 ~ w - 1 + z*(X - Y + 1e-6) }
      local at = near:init { fix = { x = unit/3 } }           -- z (k - 1)/k = w - 1 + … = -1
      expect(at(z)*1e-6*(k - 1)/k):near(1, 1e-9)
      expect(at(y - x)/unit):near(0, 1e-15)
    end
  end
end)

test("values that others determine may be typed with nine digits, and move onto the equations", function()
  for _, unit in ipairs(units) do
    local circle = dae { der(x) ~ y, 0 ~ x^2 + y^2 - unit^2 }
    for digits = 9, 17 do
      local side = tonumber(("%%.%dg"):format(digits):format(unit*math.sqrt(0.5)))
      local at = circle:init { fix = { x = side, y = side } }
      expect(at((x/unit)^2 + (y/unit)^2)):near(1, 2e-14)               -- 16 rounding errors
      expect(at(x)/side):near(1, 1e-9)
    end
    local off = tonumber(("%.7g"):format(unit*math.sqrt(0.5)))
    expect(function() circle:init { fix = { x = off, y = off } } end):fails "contradict each other"
  end
end)

test("double roots, where the residual is flat", function()
  for _, unit in ipairs(units) do
    local sys = dae { der(x) ~ -x, 0 ~ z^3 - 3*z*(x/unit)^2 + 2*(x/unit)^3 }     -- (z - x)² (z + 2 x)
    local at = sys:init { fix = { x = 0.3*unit }, guess = { z = 1 } }
    expect(at(z)):near(0.3, 1e-7)
  end
end)

-- x² + y² = r² at x = r: ½ F″ e² = y² is known to a few rounding errors of r², so y to 10⁻⁸ r.
test("a double root says that half of the digits are lost, and its zero leaves what depends on it exact", function()
  for _, unit in ipairs(units) do
    local sys = dae { x^2 + y^2 ~ (2*unit)^2, der(z) ~ -z + y, w ~ z + y, der(x) ~ y }
    local at = sys:init { fix = { x = 2*unit, z = unit }, guess = { y = 0.1*unit } }
    expect(at(y)):equals(0)
    expect(at(w)):equals(unit)
    expect(at(z.dot)):equals(-unit)
    expect(at:ledger()):matches "the Jacobian is singular here, and the equations determine .*y.* to about half"
    local simple = sys:init { fix = { x = unit, z = unit }, guess = { y = unit } }
    expect(simple:ledger():find("double root", 1, true)):equals(nil)
  end
  local sys = dae { der(x) ~ -x, 0 ~ z^2 - 2*z + x }                              -- z = 1 ± √(1 - x)
  local double = sys:init { fix = { x = 1 }, guess = { z = 0 } }
  expect(double:ledger()):matches "the equations determine z to about half of the digits only"
  local error = tonumber(double:ledger():match "z to ([%d.e+-]+)%)")
  expect(math.abs(double(z) - 1) <= error and error < 1e-6):equals(true)
  expect(sys:init { fix = { x = 0.75 }, guess = { z = 0 } }:ledger():find("double root", 1, true)):equals(nil)
end)
