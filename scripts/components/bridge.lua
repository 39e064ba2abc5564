-- Wheatstone's bridge: a linear network; its transfer function and what detunes it.
local e = components.electrical
local bridge = model { V = e.signal_source{}, R1 = e.resistor{ R = 100 }, R2 = e.resistor{ R = 100 },
  R3 = e.resistor{ R = 100 }, R4 = e.resistor{ R = 101 }, C = e.capacitor{ C = 1e-6, v0 = 0 },
    m = e.voltmeter{},
  gnd = e.ground{}, connect("V.v", input "u"), connect("V.p", "R1.p", "R3.p"),
    connect("R1.n", "R2.p", "m.p", "C.p"),
  connect("R3.n", "R4.p", "m.n"), connect("V.n", "R2.n", "R4.n", "C.n", "gnd.p") }
print(("index %d, %d free initial value"):format(bridge:index(), bridge:dof()))
local at = bridge:init{ fix = { ["C.v"] = 5 }, inputs = { u = 10 } }
print(("output at rest: %.9f V, by hand %.9f"):format(at(bridge.m.v), 10*(0.5 - 101/201)))
