-- A NAND gate of two MOSFETs in series and a resistor: its truth table, and how fast it switches.
local e = components.electrical
local R, C, V = 1e4, 1e-12, 5

local function gate(a, b)
  return model { supply = e.source{ v = V }, A = e.source{ v = a }, B = e.source{ v = b }, gnd = e.ground{},
    R = e.resistor{ R = R }, C = e.capacitor{ C = C, v0 = V }, N1 = e.mosfet{ K = 1e-3 },
    N2 = e.mosfet{ K = 1e-3 }, connect("supply.p", "R.p"), connect("R.n", "N1.d", "C.p"),
    connect("N1.s", "N2.d"), connect("A.p", "N1.g"), connect("B.p", "N2.g"),
    connect("N2.s", "gnd.p", "supply.n", "A.n", "B.n", "C.n") }
end

for _, row in ipairs { { 0, 0 }, { 0, V }, { V, 0 }, { V, V } } do
  local m = gate(row[1], row[2])
  print(("%g V, %g V -> %.3f V"):format(row[1], row[2], m:integrate{ to = 1e-6 }(m.C.v, 1e-6)))
end

-- B falls at 1 us: the capacitor is charged through the resistor, v(t) = V - (V - v_low) exp(-t/(R C))
local m = gate(V, ifelse(lt(t, 1e-6), V, 0))
local sol = m:integrate{ to = 1.05e-6, rtol = 1e-9, atol = 1e-9 }
local low = sol(m.C.v, 1e-6)
print(("rise after 10 ns: %.4f V, by hand %.4f V"):format(sol(m.C.v, 1.01e-6),
  V - (V - low)*math.exp(-1e-8/(R*C))))
