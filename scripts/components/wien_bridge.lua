-- Wien bridge: an oscillator whose amplitude the limits of the amplifier hold. f = 1/(2 pi R C).
local e = components.electrical
local R, C = 1e4, 1e-8

local m = model { A = e.opamp_limited{ A = 1e4, Vmax = 10, Vmin = -10 }, Rf = e.resistor{ R = 21e3 },
  Rg = e.resistor{ R = 10e3 }, R1 = e.resistor{ R = R }, C1 = e.capacitor{ C = C, v0 = 0.01 },
  R2 = e.resistor{ R = R }, C2 = e.capacitor{ C = C, v0 = 0 }, gnd = e.ground{},
  connect("A.out", "Rf.p", "R1.p"), connect("Rf.n", "Rg.p", "A.n"), connect("R1.n", "C1.p"),
  connect("C1.n", "R2.p", "C2.p", "A.p"), connect("Rg.n", "R2.n", "C2.n", "gnd.p") }
print(("index %d, %d free initial values"):format(m:index(), m:dof()))

local sol = m:integrate{ to = 0.05, rtol = 1e-7,
  events = { { when = m.C2.v, direction = 1, call = function() end } } }
local rises = {}
for _, event in ipairs(sol.events) do rises[#rises + 1] = event.t end
local n = #rises
print(("period %.4f ms, 2 pi R C = %.4f ms"):format(1e3*(rises[n] - rises[n - 10])/10, 2e3*math.pi*R*C))
print(("largest output %.3f V"):format(math.max(table.unpack((function()
  local list = {}
  for k = 1, 500 do list[k] = sol(m.A.out.v, 0.049 + 1e-3*k/500) end
  return list
end)()))))
