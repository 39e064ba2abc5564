-- A transistor amplifier: its operating point, and its gain against the small-signal formula.
local e = components.electrical
local Rc, Re, Vt = 2e3, 470, 0.025

local m = model { supply = e.source{ v = 12 }, signal = e.source{ v = 0.01*sin(2*pi*1000*t) },
  gnd = e.ground{},
  Rc = e.resistor{ R = Rc }, Ra = e.resistor{ R = 47e3 }, Rb = e.resistor{ R = 10e3 },
    Re = e.resistor{ R = Re },
  C = e.capacitor{ C = 10e-6 }, Q = e.npn{}, connect("supply.p", "Rc.p", "Ra.p"), connect("Rc.n", "Q.c"),
  connect("Ra.n", "Rb.p", "Q.b", "C.p"), connect("Q.e", "Re.p"), connect("signal.p", "C.n"),
  connect("supply.n", "signal.n", "Rb.n", "Re.n", "gnd.p") }

local rest = m:init{ fix = { ["C.i"] = 0 } }
local ic = (12 - rest(m.Q.c.v))/Rc
print(("collector %.3f V, base %.3f V, emitter %.3f V; %.3f mA"):format(rest(m.Q.c.v), rest(m.Q.b.v),
  rest(m.Q.e.v), 1e3*ic))
local sol = m:integrate{ start = rest, to = 5e-3, rtol = 1e-8 }
local gain = (sol(m.Q.c.v, 4.25e-3) - sol(m.Q.c.v, 4.75e-3))/0.02
print(("gain %.3f, -Rc/(Re (1 + 1/B) + Vt/ic) = %.3f"):format(gain, -Rc/(Re*1.01 + Vt/ic)))
