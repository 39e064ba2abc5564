-- Rectifier bridge: four diodes, a smoothing capacitor and a load.
local e = components.electrical
local function bridge(diode)
  return model {
    V = e.source{ v = 10*sin(2*pi*50*t) }, R = e.resistor{ R = 100 }, Ri = e.resistor{ R = 1 },
    C = e.capacitor{ C = 1e-3, v0 = 0 }, gnd = e.ground{},
    D1 = diode, D2 = diode, D3 = diode, D4 = diode,
    connect("V.p", "Ri.p"), connect("Ri.n", "D1.p", "D2.n"), connect("V.n", "D3.p", "D4.n"),
    connect("D1.n", "D3.n", "C.p", "R.p"), connect("D2.p", "D4.p", "C.n", "R.n", "gnd.p") }
end

local ideal = bridge(e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 })
print(("index %d, %d free initial value"):format(ideal:index(), ideal:dof()))
local sol = ideal:integrate{ to = 0.1, rtol = 1e-6 }
print(sol.status)
print(("ideal diodes:       %.6f V at 0.1 s (scipy, equations by hand: 9.257857)"):format(sol(ideal.C.v,
  0.1)))

local real = bridge(e.diode{ Is = 1e-9, Vt = 0.05, G = 1e-6 })
local smooth = real:integrate{ to = 0.1, rtol = 1e-6 }
print(("exponential diodes: %.3f V at 0.1 s"):format(smooth(real.C.v, 0.1)))
print(plot(sol, { ideal.C.v, ideal.V.v }))
