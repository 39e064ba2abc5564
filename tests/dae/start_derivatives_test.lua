-- Derivatives at a start that its model does not name: der(z) of multipliers and algebraic variables.

local x, y, z = vars "x y z"
local g, L = params "g=9.81 L=1"
local pendulum = dae { der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - g, 0 ~ x^2 + y^2 - L^2 }

test("derivatives of a multiplier", function()
  for _, g_value in ipairs { 9.81, 98.1 } do
    local at = pendulum:init { fix = { x = 0.6, [x.dot] = 0.3 }, guess = { y = -0.8 },
      params = { g = g_value } }
    -- z = (v² - g y)/L², hence z′ = -3 g y′/L² and z″ = -3 g y″/L²
    expect(at(der(z))):near(-3*g_value*at(y.dot), 1e-11)
    expect(at(der(z, 2))):near(-3*g_value*at(y.ddot), 1e-10)
    expect(at(der(x, 3) + der(z)*x + z*x.dot)):near(0, 1e-10)
  end
end)

test("derivatives along a solution agree", function()
  local at = pendulum:init { fix = { x = 0.6, [x.dot] = 0.3 }, guess = { y = -0.8 } }
  local sol = pendulum:reduce "acc":integrate { start = at, to = 0.01, rtol = 1e-11, atol = 1e-11 }
  local slope = (sol(z, 0.002) - sol(z, 0))/0.002
  expect(slope):near(at(der(z)) + 0.001*at(der(z, 2)), 1e-4)
end)

test("derivatives of algebraic variables, with inputs", function()
  local u = input "u"
  local sys = dae { der(x) ~ -z, 0 ~ z^3 + z - x - u }
  local at = sys:init { fix = { x = 2 }, guess = { z = 1 }, inputs = { u = sin(t) } }
  expect(at(der(z))):near((at(der(x)) + 1)/(3*at(z)^2 + 1), 1e-12)
  local numbers = sys:init { fix = { x = 2 }, guess = { z = 1 },
    inputs = { u = function(s) return math.floor(s) end } }
  expect(function() return numbers(der(z)) end):fails "does not follow"
end)

test("what the equations leave open is an error", function()
  local free = dae { der(x) ~ y, 0 ~ x - y }
  expect(free:init { fix = { x = 1 } }(der(y))):near(1, 1e-14)
  expect(function() return free:init { fix = { x = 1 } }(der(var "w")) end):fails "no value for 'w′'"
end)
