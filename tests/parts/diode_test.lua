-- Circuits whose currents differ by many powers of ten, and parameters that are set to 0 after elimination.
local e, l = components.electrical, components.translational

local function bridge(diode)
  return model {
    V = e.source{ v = 10*sin(2*pi*50*t) }, R = e.resistor{ R = 100 }, Ri = e.resistor{ R = 1 },
    C = e.capacitor{ C = 1e-3, v0 = 0 }, gnd = e.ground{}, D1 = diode, D2 = diode, D3 = diode, D4 = diode,
    connect("V.p", "Ri.p"), connect("Ri.n", "D1.p", "D2.n"), connect("V.n", "D3.p", "D4.n"),
    connect("D1.n", "D3.n", "C.p", "R.p"), connect("D2.p", "D4.p", "C.n", "R.n", "gnd.p") }
end

-- The same with equations that lose nothing: the currents of the diodes at the two ends of the source alone.
local function by_hand(Is, Vt, G, method, rtol)
  local c, d1, d2, d3, d4 = vars "c d1 d2 d3 d4"
  local function I(v) return Is*(exp(v/Vt) - 1) + G*v end
  local hand = dae { 0 ~ d1 + d2 + c, 0 ~ d3 + d4 + c, 1e-3*der(c) ~ I(d1) + I(d3) - c/100,
    0 ~ I(d1) - I(d2) + I(d3) - I(d4), 10*sin(2*pi*50*t) ~ I(d1) - I(d2) - d2 + d4 }
  local at = hand:init{ fix = { c = 0 }, guess = { d1 = 0, d2 = 0, d3 = 0, d4 = 0 } }
  return hand:integrate{ start = at, to = 0.1, rtol = rtol or 1e-6, method = method }(c, 0.1)
end

for _, values in ipairs { { 1e-9, 0.05, 1e-6 }, { 1e-9, 0.05, 1e-9 }, { 1e-12, 0.025, 1e-9 },
  { 1e-14, 0.025, 1e-9 }, { 1e-12, 0.05, 1e-10 } } do
  local Is, Vt, G = table.unpack(values)
  test(("a bridge of diodes with Is = %g, Vt = %g, G = %g runs"):format(Is, Vt, G), function()
    local m = bridge(e.diode{ Is = Is, Vt = Vt, G = G })
    local sol = m:integrate{ to = 0.1, rtol = 1e-6 }
    expect(sol.status):equals "finished"
    expect(sol(m.C.v, 0.1)):near(by_hand(Is, Vt, G), 1e-4)
    expect(sol(m.D1.i - m.D2.i + m.D3.i - m.D4.i, 0.1)):near(0, 1e-9)
  end)
end

test("no pulse of a rectifier is passed over between two stages", function()
  for _, values in ipairs { { 1e-9, 0.05, 1e-6 }, { 1e-14, 0.025, 1e-9 }, { 1e-12, 0.05, 1e-10 } } do
    local Is, Vt, G = table.unpack(values)
    local exact = by_hand(Is, Vt, G, "radau", 1e-9)
    for _, method in ipairs { "auto", "verner87", "dopri5", "tsit5", "radau", "gauss" } do
      for k = 0, 12 do
        local rtol = 1e-5*10^(-k/4)
        expect(by_hand(Is, Vt, G, method, rtol)):near(exact, 1000*rtol)
      end
    end
  end
end)

test("a model without states needs no start", function()
  local m = model { V = e.source{ v = 10*sin(2*pi*50*t) }, D = e.diode{}, R = e.resistor{ R = 1000 },
    gnd = e.ground{}, connect("V.p", "D.p"), connect("D.n", "R.p"), connect("V.n", "R.n", "gnd.p") }
  local sol = m:integrate{ to = 0.02 }
  expect(sol.status):equals "finished"
  expect(sol(m.R.v, 0.005)):near(10 - 0.025*math.log(sol(m.R.i, 0.005)/1e-12), 1e-2)
  expect(sol(m.R.v, 0.015)):near(0, 1e-4)
end)

test("guesses for variables that were eliminated count", function()
  local x, y, u = vars "x y u"
  local m = dae { der(u) ~ -u, x^2 ~ 4 + 0*u, y ~ -3*x + 1 }:eliminate()
  expect(m:init{ fix = { u = 0 }, guess = { y = 6 } }(x)):near(-2, 1e-9)
  expect(m:init{ fix = { u = 0 }, guess = { y = -4 } }(x)):near(2, 1e-9)
end)

local function loaded()
  return model { V = e.source{ v = 1 }, R = e.resistor{ R = 1000 }, S = e.resistor{ R = 10 },
    C = e.capacitor{ C = 1e-5 }, gnd = e.ground{}, connect("V.p", "R.p"), connect("R.n", "C.p", "S.p"),
    connect("V.n", "C.n", "S.n", "gnd.p") }
end

test("a parameter may be 0 although elimination has divided by it", function()
  local m = loaded()
  local function current(params) return m:integrate{ to = 0.1, start = {}, params = params }(m.S.i, 0.1) end
  expect(current{ ["R.R"] = 0 }):near(0.1, 1e-9)
  expect(current{ ["S.R"] = 0 }):near(1e-3, 1e-9)
  expect(current{ [m.C.C] = 0 }):near(1/1010, 1e-9)
  expect(current{ [m.C.C] = 0, ["R.R"] = 90 }):near(1/100, 1e-9)
  expect(m:with{ ["R.R"] = 0 }:init{}(m.S.i)):near(0.1, 1e-9)
  expect(m:init{ params = { ["S.R"] = 0 } }(m.S.i + m.S.R)):near(1e-3, 1e-9)
end)

test("what is 0 then is 0 in every answer", function()
  local m = model { m = l.mass{ m = 2, s0 = 1, v0 = 0 }, c = l.spring_damper{ k = 8, d = 1 }, w = l.fixed{},
    connect("w.flange", "c.a"), connect("c.b", "m.flange") }
  local sol = m:integrate{ to = math.pi, params = { ["c.d"] = 0 }, rtol = 1e-9 }
  expect(sol(m.m.s*(1 + m.c.d), math.pi)):near(1, 1e-6)
  expect(sol(m.c.d, 0)):near(0, 0)
  local heavy = m:with{ [m.c.d] = 0, ["m.m"] = 8 }
  expect(heavy:integrate{ to = math.pi, rtol = 1e-9 }(m.m.s, math.pi)):near(-1, 1e-6)
  expect(heavy:dof()):equals(2)
end)

test("eliminate{ zero = … } names what it does not know", function()
  expect(function() return loaded():flat():eliminate{ zero = { "R.Q" } } end):fails "R.Q"
end)

-- The pulses of current are shorter than the steps between them: a step must not pass over one.
test("a bridge of ideal diodes keeps its tolerance with every method", function()
  local e, diode = components.electrical, components.electrical.ideal_diode{ Ron = 1e-3, Goff = 1e-6 }
  local bridge = model {
    V = e.source{ v = 10*sin(2*pi*50*t) }, R = e.resistor{ R = 100 }, Ri = e.resistor{ R = 1 },
    C = e.capacitor{ C = 1e-3, v0 = 0 }, gnd = e.ground{},
    D1 = diode, D2 = diode, D3 = diode, D4 = diode,
    connect("V.p", "Ri.p"), connect("Ri.n", "D1.p", "D2.n"), connect("V.n", "D3.p", "D4.n"),
    connect("D1.n", "D3.n", "C.p", "R.p"), connect("D2.p", "D4.p", "C.n", "R.n", "gnd.p") }
  local exact = 9.25785734                                 -- radau, rtol = 1e-10, and dopri5, 1e-9
  for _, rtol in ipairs { 1e-3, 1e-4, 1e-6, 1e-8 } do
    for _, method in ipairs { "auto", "dopri5", "radau", "bdf" } do
      local sol = bridge:integrate{ to = 0.1, rtol = rtol, method = method }
      if sol.status == "finished" then
        expect(sol(bridge.C.v, 0.1)/exact):near(1, 10*rtol + 1e-8)
      else                                               -- implicit methods may end at a kink, and say so
        expect(method == "radau" or method == "bdf"):is_true()
        expect(sol.status):matches "^stopped at"
      end
    end
  end
end)

-- While a rectifier blocks, a step of high order spans periods of its source: no pulse of current may be lost
-- in it.
test("a bridge conducts in every half period, whatever the tolerance and the frequency", function()
  local function bridge(f, peak)
    local D = e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 }
    return model { V = e.source{ v = peak*sin(2*pi*f*t) }, R = e.resistor{ R = 100 },
      Ri = e.resistor{ R = 1 },
      C = e.capacitor{ C = 0.05/f, v0 = 0 }, gnd = e.ground{}, D1 = D, D2 = D, D3 = D, D4 = D,
      connect("V.p", "Ri.p"), connect("Ri.n", "D1.p", "D2.n"), connect("V.n", "D3.p", "D4.n"),
      connect("D1.n", "D3.n", "C.p", "R.p"), connect("D2.p", "D4.p", "C.n", "R.n", "gnd.p") }
  end
  local curve                                          -- the same in f t and v/peak
  for _, case in ipairs { { 50, 10, 1e-9 }, { 50, 10, 1e-4 }, { 50, 10, 1e-5 }, { 50, 10, 1e-6 },
    { 50, 10, 1e-7 },
    { 400, 325, 1e-6 }, { 0.02, 1, 1e-6 } } do
    local f, peak, rtol = table.unpack(case)
    local m = bridge(f, peak)
    local sol = m:integrate{ to = 5/f, rtol = rtol, atol = 1e-2*rtol*peak }
    expect(sol.status):equals "finished"
    local values = {}
    for k = 1, 100 do values[k] = sol(m.C.v, k/20/f)/peak end
    curve = curve or values
    for k = 1, 100 do expect(values[k]):near(curve[k], 100*rtol) end
  end
end)

test("a differential pair starts: currents of mA beside a saturation current of 10⁻¹⁶ A", function()
  local vd = 0.02
  local m = model { VC = e.source{ v = 10 }, VE = e.source{ v = 10 }, gnd = e.ground{}, Q1 = e.npn{},
    Q2 = e.npn{}, I = e.current{ i = 1e-3 }, R1 = e.resistor{ R = 1000 }, R2 = e.resistor{ R = 1000 },
    B1 = e.source{ v = vd/2 }, B2 = e.source{ v = -vd/2 }, connect("VC.p", "R1.p", "R2.p"),
    connect("R1.n", "Q1.c"), connect("R2.n", "Q2.c"), connect("Q1.e", "Q2.e", "I.p"), connect("I.n", "VE.n"),
    connect("VE.p", "VC.n", "gnd.p", "B1.n", "B2.n"), connect("B1.p", "Q1.b"), connect("B2.p", "Q2.b") }
  local at = m:init{}                                      -- α I tanh(vd/(2 Vt)), α = Bf/(1 + Bf)
  expect(at(m.Q1.c.i - m.Q2.c.i)):near(1e-3*100/101*math.tanh(vd/0.05), 1e-9)
end)
