-- Heat in a motor: losses of the winding that come and go, losses of the core, cooling by convection. The
-- example Motor of physical modelling libraries (HeatTransfer).
local h, s = components.thermal, components.signals
local T0 = 293.15

local m = model { winding = h.capacity{ C = 2500, T0 = T0 }, core = h.capacity{ C = 25000, T0 = T0 },
  between = h.conductor{ G = 10 }, convection = h.conductor{ G = 25 }, air = h.temperature{ T = T0 },
  copper = h.signal_heat_flow{}, iron = h.heat_flow{ Q = 500 },
  load = s.pulse{ period = 600, width = 0.6, low = 100, high = 500 }, connect("load.y", "copper.Q"),
  connect("copper.port", "winding.port", "between.a"),
  connect("between.b", "core.port", "iron.port", "convection.a"), connect("convection.b", "air.port") }

local sol = m:integrate{ to = 7200, rtol = 1e-9 }
print(("winding %.4f, core %.4f degrees C (scipy, piece by piece: 76.4780, 53.4621)"):format(
  sol(m.winding.T, 7200) - 273.15, sol(m.core.T, 7200) - 273.15))
print(("between %.2f and %.2f degrees C in the last period"):format(sol(m.winding.T, 7200) - 273.15,
  sol(m.winding.T, 6960) - 273.15))
print(plot(sol, { m.winding.T, m.core.T }))
