-- Inrush of a transformer: switched on at the zero of the voltage, with remanence, its iron saturates.
local e = components.electrical
local m = model { V = e.source{ v = 325*sin(2*pi*50*t) }, R = e.resistor{ R = 1 },
  T = e.saturating_inductor{ L = 1, psi0 = 0.2 }, gnd = e.ground{},
  connect("V.p", "R.p"), connect("R.n", "T.p"), connect("V.n", "T.n", "gnd.p") }
local sol = m:integrate{ to = 0.2, rtol = 1e-9, atol = 1e-9 }
print(("current at 10 ms: %.4f A (scipy, equations by hand: 104.2549)"):format(sol(m.T.i, 0.01)))
print(("rated amplitude:  %.3f A"):format(325/math.sqrt(1 + (100*math.pi)^2)))
print(("after ten periods: flux %.6f V s (scipy: -0.891864)"):format(sol(m.T.psi, 0.2)))
print(plot(sol, m.T.i))
