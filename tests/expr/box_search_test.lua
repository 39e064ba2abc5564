-- Equilibria in numbers: against closed forms, in other units, and what is refused.

-- A stirred tank reactor with an exothermic reaction and three equilibria (Seborg, Edgar, Mellichamp & Doyle,
-- Process Dynamics and Control, 4th ed., example 2.5); litre, minute, kelvin and mole, or others.
local function reactor(litre, minute, kelvin)
  local c, T = vars "c T"
  local volume, flow, k0 = 100*litre, 100*litre/minute, 7.2e10/minute
  local r = k0*exp(-8750*kelvin/T)*c
  return dae { der(c) ~ flow/volume*(1/litre - c) - r,
    der(T) ~ flow/volume*(350*kelvin - T) + 209*kelvin*litre*r + 2.09/minute*(300*kelvin - T) },
    { c = { 0, 1/litre }, T = { 300*kelvin, 450*kelvin } }
end

test("a search finds the three equilibria of a reactor, in any units", function()
  local sys, box = reactor(1, 1, 1)
  local list = equilibria(sys, { within = box })
  expect(#list):equals(3)
  local other, other_box = reactor(1e-3, 60, 1.8)              -- m³, s, degrees Rankine
  local scaled = equilibria(other, { within = other_box })
  expect(#scaled):equals(3)
  for k = 1, 3 do
    expect(scaled[k].T/1.8):near(list[k].T, 1e-9)
    expect(scaled[k].c*1e-3):near(list[k].c, 1e-11)
    expect(scaled[k].stable):equals(list[k].stable)
    local c, T = list[k].c, list[k].T                          -- the balance of matter, by hand
    local rate = 7.2e10*math.exp(-8750/T)
    expect(1 - c - rate*c):near(0, 1e-9)
    expect(list[k].A(1, 1)):near(-1 - rate, 1e-6)
    expect(list[k].A(2, 2)):near(-3.09 + 209*rate*c*8750/T^2, 1e-6)
  end
  expect(list[1].stable):equals(false)                         -- hot: det A > 0, but trace A > 0
  expect(list[1].A(1, 1) + list[1].A(2, 2) > 0):equals(true)
  expect(list[2].stable):equals(false)                         -- a saddle
  expect(list[3].stable):equals(true)                          -- cold
  expect(tostring(list)):matches "found by Newton's method from 200 points of the box; there may be more"
end)

test("a search agrees with the closed form, and stays in its box", function()
  local x, y = vars "x y"
  local sys = dae { der(x) ~ x - x*y, der(y) ~ x*y - y }
  local list = equilibria(sys, { within = { [x] = { -1, 2 }, y = { -1, 2 } } })
  expect(#list):equals(#equilibria(sys))
  expect(list[2].x):near(1, 1e-12)
  local half = equilibria(dae { der(x) ~ sin(pi*x)*exp(x) }, { within = { x = { 0.5, 3.5 } } })
  expect(#half):equals(3)
  for k = 1, 3 do expect(half[k].x):near(k, 1e-12) end
  local none = equilibria(dae { der(x) ~ exp(x) + 1 }, { within = { x = { -10, 10 } } })
  expect(#none):equals(0)
  expect(tostring(none)):equals "no equilibrium was found in the box, from 100 starts"
end)

test("without a closed form the error shows the call of the search", function()
  local x, k = var "x", param "k"
  local sys = dae { der(x) ~ exp(-x) + x^2*sin(x) - k }
  local call = "equilibria(sys, { within = { x = { …, … } } }) searches a box in numbers"
  expect(function() equilibria(sys) end):fails(call)
  expect(function() equilibria(sys, { within = { x = { 0, 1 } } }) end)
    :fails "k has no value: params = { k = … }"
  local function search(within)
    return function() equilibria(sys, { params = { k = 1 }, within = within }) end
  end
  expect(search {}):fails "a search needs the range of x = { …, … }"
  expect(search { x = { 1, 0 } }):fails "within: expected { lower, upper } for x"
  expect(search { x = 3 }):fails "within: expected { lower, upper } for x"
  expect(search { x = { 0, 1 }, y = { 0, 1 } }):fails "within: the model has no unknown 'y'"
end)
