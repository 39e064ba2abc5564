-- Models inside models: dae{ plant, F ~ law }.

local q = var("q", 2)
local m, k = params "m=2 k=10"
local F, G = inputs "F G"
local cart = lagrange { q = q, T = m/2*q.dot.T*q.dot, V = q[1]^2, Q = vec(F, 0) }
local start = { [q] = { 1, 0 }, [q.dot] = { 0, 0 } }

test("an equation for an input closes the loop", function()
  local law = -k*q[1] - q.dot[1]
  local closed = dae { cart, F ~ law }
  expect(#closed.inputs):equals(0)
  local by_hand = dae { m*q.ddot[1] ~ law - 2*q[1], m*q.ddot[2] ~ 0 }
  local a = closed:integrate { start = start, to = 3, rtol = 1e-9, atol = 1e-9 }
  local b = by_hand:integrate { start = start, to = 3, rtol = 1e-9, atol = 1e-9 }
  expect(a(q, 3)):near(b(q, 3), 1e-7)
  expect(a(F, 2)):near(a(law, 2), 1e-12)        -- the input keeps its meaning
  expect(closed:init { fix = start }(F)):near(-10, 1e-12)
end)

test("lists of equations nest as models do", function()
  local x = var "x"
  for _, closed in ipairs { dae { cart.equations, F ~ -k*q[1] }, dae { { cart.equations }, F ~ -k*q[1] },
    dae { cart, { F ~ -k*q[1] } } } do
    expect(#closed.inputs):equals(0)
    expect(#closed.differential):equals(4)
  end
  local both = dae { cart, der(x) ~ -x + F, F ~ 2*x }
  expect(#both.differential):equals(5)
end)

test("chains of inputs, columns of inputs and derivatives of inputs", function()
  local chain = dae { cart, F ~ 2*G, G ~ -q[1] }
  expect(#chain.inputs):equals(0)
  expect(chain:init { fix = start }(F)):equals(-2)
  expect(tostring(dae { cart, F ~ 2*G }.inputs)):equals "(G)"
  local u = input("u", 2)
  local x = var("x", 2)
  local plant = dae { der(x) ~ u }
  expect(#dae { plant, u ~ -x }.inputs):equals(0)
  local y, v = vars "y v"
  local differentiator = dae { der(y) ~ F.dot }
  local closed = dae { differentiator, der(v) ~ 1, F ~ v^2 }
  expect(closed:integrate { start = { y = 0, v = 0 }, to = 1 }(y, 1)):near(1, 1e-5)
end)

test("values of parameters come with the parts", function()
  expect(dae { cart:with { m = 5 }, F ~ -q[1] }:with{}.parameters):equals(vec(m))
  local heavy = dae { cart:with { m = 5 }, F ~ -q[1] }
  expect(heavy:integrate { start = start, to = 1 }(m)[1]):equals(5)
  expect(function() dae { cart:with { m = 5 }, cart:with { m = 6 } } end)
    :fails "has the value 5 in one part and 6"
end)

test("what cannot be put together is refused", function()
  expect(function() dae { cart, F ~ F + q[1] } end):fails "form a cycle"
  expect(function() dae { cart, F ~ G, G ~ F } end):fails "F, G form a cycle"
  expect(function() dae { cart, F ~ 1, F ~ 2 } end):fails "two equations for the input 'F'"
  local x, z = vars "x z"
  local low = dae { der(x) ~ z, 0 ~ x - sin(t) }:reduce()
  expect(function() dae { low, der(var "y") ~ 1 } end):fails "reduce the whole"
  expect(function() dae { cart, 3 } end):fails "entry 2 of the list of equations"
  expect(function() dae { cart, { F ~ 1, 3 } } end):fails "entry 2 of entry 2"
end)
