-- Exponential elements far from where their start begins: from one side Newton's iteration overflows, from
-- the other it comes down by 1 in the exponent a step. dae/newton/lifted_newton takes exponents as unknowns.

-- A node's voltage is v + shift, so that all guesses are volts away; sources balance the currents at chosen
-- voltages, of at most `most` A: conductances stay within twelve decades.
local most, thermal = 10, 0.026
local function net(seed, nodes)
  math.randomseed(seed)
  local random = math.random
  local span, volt, ampere = ({ 1, 10, 40 })[random(3)], 10^(3*random(-1, 1)), 10^(3*random(-1, 1))
  local function level() return (2*random() - 1)*span end
  local v, true_v, shift, law, balance = {}, {}, {}, {}, {}
  for k = 1, nodes do
    v[k], true_v[k], shift[k], law[k], balance[k] = var(("v%d"):format(k)), level(), level(), 0, 0
  end
  local function at(k) return k == 0 and 0 or v[k]/volt + shift[k] end
  local function value(k) return k == 0 and 0 or true_v[k] end
  local function draw(k, current, number)
    if k > 0 then law[k], balance[k] = law[k] + current*ampere, balance[k] + number*ampere end
  end
  local function between(i, j, current, number) draw(i, current, number) draw(j, -current, -number) end
  for k = 1, nodes do
    local other, G = random(0, k - 1), 10^(4*random() - 4)
    between(k, other, G*(at(k) - at(other)), G*(value(k) - value(other)))
  end
  for _ = 1, nodes do
    local i, j, both_ways = random(0, nodes), random(0, nodes), random() < 0.3
    if value(i) - value(j) > 0.8 then i, j = j, i end                         -- a diode from i to j
    local drop, Is = value(i) - value(j), 10^(-random(9, 14))
    if both_ways then drop = drop/20 end
    while Is*math.exp(math.abs(drop)/thermal) > most do Is = Is/10 end
    local s = (at(i) - at(j))/thermal
    if both_ways then between(i, j, Is*sinh(s/20), Is*(math.exp(drop/thermal) - math.exp(-drop/thermal))/2)
    else between(i, j, Is*(exp(s) - 1), Is*(math.exp(drop/thermal) - 1)) end
  end
  local equations = {}
  for k = 1, nodes do equations[k] = law[k] ~ balance[k] end
  return dae(equations), v, function(k) return (true_v[k] - shift[k])*volt end, volt
end

test("nets of resistors, diodes and sinh elements whose voltages are known", function()
  for seed = 1, 40 do
    local sys, v, expected, volt = net(seed, 1 + seed % 9)
    local at = sys:init()
    for k, one in ipairs(v) do expect((at(one) - expected(k))/volt):near(0, 1e-6) end
  end
  local sys, v, expected, volt = net(41, 150)
  local at = sys:init()
  for k, one in ipairs(v) do expect((at(one) - expected(k))/volt):near(0, 1e-6) end
end)

local x, w = vars "x w"
test("a diode behind a source and a resistor, in any units: U = R w + V log(w/Is + 1)", function()
  for _, volt in ipairs { 1e-3, 1, 1e3 } do
    for _, U in ipairs { -40, -1, 0, 0.5, 1, 2, 5, 20, 200, 2000 } do
      local sys = dae { der(x) ~ w - x, w ~ 1e-9*(exp((U - x/volt - 10*w)/0.026) - 1) }
      local current = sys:init { fix = { [x] = 0 } }(w)
      if U < 0 then expect(current):near(-1e-9, 1e-15)
      else expect(10*current + 0.026*math.log(current/1e-9 + 1)):near(U, 1e-8*U) end
    end
  end
end)

test("a guessed state stays, from which a current follows", function()
  local sys = dae { der(x) ~ w, w ~ 1e-9*(exp((5 - x - 10*w)/0.026) - 1) }
  local at = sys:init { guess = { x = 0 } }
  expect(at(x)):equals(0)
  expect(10*at(w) + 0.026*math.log(at(w)/1e-9 + 1)):near(5, 1e-8)
end)

test("diodes in series share the voltage, powers with a constant base are exponentials", function()
  local i = var "i"
  local v = {}
  for k = 1, 11 do v[k] = var(("v%d"):format(k)) end
  local chain = { 0 ~ i - (50 - v[1])/100 }
  for k = 1, 10 do chain[#chain + 1] = i ~ 1e-12*(exp((v[k] - v[k + 1])/0.026) - 1) end
  chain[#chain + 1] = v[11] ~ 0
  local at = dae(chain):init()
  expect(100*at(i) + 10*0.026*math.log(at(i)/1e-12 + 1)):near(50, 1e-9)
  for k = 1, 10 do expect(at(v[k] - v[k + 1])):near(at(v[1])/10, 1e-9) end
  local y = dae { 0 ~ 2^(x - 3000) - 1000 + x/8 }:init()(x)
  expect(2^(y - 3000)):near(1000 - y/8, 1e-9)
end)

test("an exponential that underflows is no proof that there is no solution", function()
  local sys = dae { 0 ~ 8*(x - 0.0225) - 1e-10*(exp(40000*(0.0225 - x)) - 1) - 0.276 }
  expect(sys:init()(x)):near(0.0225 + (0.276 - 1e-10)/8, 1e-15)
  local none = dae { der(x) ~ w, 0 ~ exp(w) + x^2 }
  expect(function() none:init { fix = { x = 1 } } end):fails "have no solution"
end)
