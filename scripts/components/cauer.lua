-- Cauer low-pass filter of fifth order: a ladder of capacitors and resonant arms between two resistors.
-- The example CauerLowPassAnalog of physical modelling libraries; elements after Saal, Handbuch zum
-- Filterentwurf.
local e = components.electrical
local L, C = e.inductor, e.capacitor
local function volts(c) return C{ C = c, v0 = 0 } end

local filter = model {
  V = e.source{ v = ifelse(lt(t, 1), 0, 1) }, R1 = e.resistor{ R = 1 }, R2 = e.resistor{ R = 1 },
    gnd = e.ground{},
  C1 = volts(1.072), C2 = C{ C = 1/(1.704992^2*1.304), v0 = false }, L1 = L{ L = 1.304, i0 = 0 },
  C3 = volts(1.682), C4 = C{ C = 1/(1.179945^2*0.8586), v0 = false }, L2 = L{ L = 0.8586, i0 = 0 },
  C5 = volts(0.7262),
  connect("V.p", "R1.p"), connect("R1.n", "C1.p", "C2.p", "L1.p"),
    connect("C2.n", "L1.n", "C3.p", "C4.p", "L2.p"),
  connect("C4.n", "L2.n", "C5.p", "R2.p"), connect("V.n", "C1.n", "C3.n", "C5.n", "R2.n", "gnd.p") }

print(("%d equations, index %d, %d free initial values"):format(#filter:flat().equations, filter:index(),
  filter:dof()))
local low = filter:reduce()
local sol = low:integrate{ to = 60, rtol = 1e-8 }
for _, time in ipairs { 2, 5, 10, 60 } do print(("v(%d) = %.6f"):format(time, sol(filter.R2.v, time))) end
print "Published for 60 s (Modelica Standard Library, FMI cross check): v = 0.4997056"

-- Without the source the network is linear: its transfer function, and the frequencies that do not come
-- through.
local u = input "u"
local G = model { V = e.signal_source{}, R1 = e.resistor{ R = 1 }, R2 = e.resistor{ R = 1 }, gnd = e.ground{},
  C1 = C{ C = 1.072 }, C2 = C{ C = 1/(1.704992^2*1.304) }, L1 = L{ L = 1.304 }, C3 = C{ C = 1.682 },
  C4 = C{ C = 1/(1.179945^2*0.8586) }, L2 = L{ L = 0.8586 }, C5 = C{ C = 0.7262 }, connect("V.v", u),
  connect("V.p", "R1.p"), connect("R1.n", "C1.p", "C2.p", "L1.p"), connect("C2.n", "L1.n", "C3.p", "C4.p",
    "L2.p"),
  connect("C4.n", "L2.n", "C5.p", "R2.p"), connect("V.n", "C1.n", "C3.n", "C5.n", "R2.n", "gnd.p") }:tf(u,
    var "C5.v")
print(G)
print(G:zeros())
