-- A Sallen-Key low-pass: its transfer function with the elements as symbols' values, exactly; Butterworth for
-- C1 = 2, C2 = 1 and R = 1 over the square root of 2.
local e = components.electrical
local u = input "u"

local function filter(R1, R2, C1, C2)
  local m = model { V = e.signal_source{}, R1 = e.resistor{ R = R1 }, R2 = e.resistor{ R = R2 },
    C1 = e.capacitor{ C = C1 }, C2 = e.capacitor{ C = C2 }, A = e.opamp{}, gnd = e.ground{},
      connect("V.v", u),
    connect("V.p", "R1.p"), connect("R1.n", "R2.p", "C1.p"), connect("R2.n", "C2.p", "A.p"),
    connect("A.n", "A.out", "C1.n"), connect("V.n", "C2.n", "gnd.p") }
  return m:tf(u, m.A.out.v)
end

print(filter(1, 1, 2, "1/2"))
local R = 1/math.sqrt(2)
local G = filter(R, R, 2, 1)
print(G:poles())
print(("gain at the corner: %.12f, 1/sqrt(2) = %.12f"):format(G:freqresp{ 1 }.mag(1, 1), math.sqrt(0.5)))
