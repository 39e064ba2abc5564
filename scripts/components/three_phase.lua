-- A three-phase bridge of six diodes feeds a resistor and an inductor.
local e = components.electrical
local D, items, plus, minus, star = e.ideal_diode{ Ron = 1e-2, Goff = 1e-5 }, { gnd = e.ground{} }, {}, {},
  { "gnd.p" }
for k = 1, 3 do
  items["V" .. k] = e.source{ v = 100*cos(2*pi*50*t - 2*pi*(k - 1)/3) }
  items["R" .. k], items["U" .. k], items["L" .. k] = e.resistor{ R = 0.1 }, D, D
  items[#items + 1] = connect(("V%d.p"):format(k), ("R%d.p"):format(k))
  items[#items + 1] = connect(("R%d.n"):format(k), ("U%d.p"):format(k), ("L%d.n"):format(k))
  plus[k], minus[k], star[k + 1] = ("U%d.n"):format(k), ("L%d.p"):format(k), ("V%d.n"):format(k)
end
items.R, items.L = e.resistor{ R = 10 }, e.inductor{ L = 0.05, i0 = 0 }
plus[4], minus[4] = "R.p", "L.n"
for _, list in ipairs { plus, minus, star, { "R.n", "L.p" } } do
  items[#items + 1] = connect(table.unpack(list))
end
local m = model(items)
local sol = m:integrate{ to = 0.06, rtol = 1e-8 }
print(("current at 10 ms: %.6f A (scipy, equations by hand: 14.078091)"):format(sol(m.L.i, 0.01)))
local sum, n = 0, 600
for k = 0, n - 1 do sum = sum + sol(m.R.p.v - m.L.n.v, 0.04 + 0.02*(k + 0.5)/n)/n end
-- ideal: 3 √3/π Û = 165.4 V; two conducting diodes and lines take 0.22 Ohm
print(("mean voltage: %.2f V (ideal bridge 165.40, less 0.22 Ohm: %.2f)"):format(sum, 165.399*10/10.22))
print(plot(sol, { m.R.p.v - m.L.n.v, 10*m.L.i }, { labels = { "voltage", "10 × current" } }))
