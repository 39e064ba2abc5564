-- A step-down converter: a switch that is on half of the time, a diode, an inductor, a capacitor and a load.
local e, s = components.electrical, components.signals
local toggle = { { from = 1, to = 2, when = function(_, since) return since - 5e-5 end },
                 { from = 2, to = 1, when = function(_, since) return since - 5e-5 end } }
local buck = model {
  V = e.source{ v = 12 }, S = e.switch{ Ron = 1e-3, Goff = 1e-6 },
    D = e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 },
  L = e.inductor{ L = 1e-3, i0 = 0 }, C = e.capacitor{ C = 1e-4, v0 = 0 }, R = e.resistor{ R = 10 },
    gnd = e.ground{},
  clock = s.state_machine{ inputs = 0, transitions = toggle, y = { 1, 0 } }, connect("clock.y", "S.on"),
  connect("V.p", "S.p"), connect("S.n", "D.n", "L.p"), connect("L.n", "C.p", "R.p"),
  connect("V.n", "D.p", "C.n", "R.n", "gnd.p") }
local sol = buck:integrate{ to = 0.02, rtol = 1e-6 }
print(sol.status)
local sum = 0
for k = 0, 99 do sum = sum + sol(buck.R.v, 0.0199 + k*1e-6) end
print(("mean voltage of the load: %.2f V (half of 12 V by hand)"):format(sum/100))
