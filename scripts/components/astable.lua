-- An astable multivibrator: two transistors that switch each other off in turn, T = 2 ln(2) R C. The small
-- capacitors at the bases are those of the junctions: without them the change of sides takes no time at all.
local e = components.electrical
local R, C = 47e3, 1e-6
local base = e.capacitor{ C = 1e-10, v0 = 0 }

local m = model { supply = e.source{ v = 5 }, gnd = e.ground{}, Rc1 = e.resistor{ R = 1e3 },
  Rc2 = e.resistor{ R = 1e3 }, Rb1 = e.resistor{ R = R }, Rb2 = e.resistor{ R = R },
  C1 = e.capacitor{ C = C, v0 = 0.1 }, C2 = e.capacitor{ C = C, v0 = 0 }, Q1 = e.npn{}, Q2 = e.npn{},
  B1 = base, B2 = base, connect("supply.p", "Rc1.p", "Rc2.p", "Rb1.p", "Rb2.p"),
  connect("Rc1.n", "Q1.c", "C1.p"), connect("C1.n", "Q2.b", "Rb2.n", "B2.p"),
  connect("Rc2.n", "Q2.c", "C2.p"), connect("C2.n", "Q1.b", "Rb1.n", "B1.p"),
  connect("supply.n", "Q1.e", "Q2.e", "gnd.p", "B1.n", "B2.n") }

local sol = m:integrate{ to = 0.5, rtol = 1e-7, events = {
  { when = m.Q1.c.v - 2.5, call = function() end } } }
local at = sol.events
local k = #at - 2
if sol(m.Q1.c.v, at[k].t + 1e-4) < 2.5 then k = k + 1 end                -- Q1 is off from at[k] to at[k + 1]
local off, on = at[k].t, at[k + 1].t
local low, high = sol(m.Q1.b.v, off + 1e-4), sol(m.Q1.b.v, on - 1e-4)
print(("half a period %.3f ms; from %.3f V to %.3f V by R C: %.3f ms"):format(1e3*(on - off), low, high,
  2e-1 + 1e3*R*C*math.log((5 - low)/(5 - high))))
print(("period %.2f ms, 2 ln(2) R C = %.2f ms"):format(1e3*(at[k + 1].t - at[k - 1].t), 2e3*math.log(2)*R*C))
