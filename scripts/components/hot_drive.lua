-- Motor, gear and rigid load; the winding becomes warm and its resistance grows: three domains in one model.
local e, r, h = components.electrical, components.rotational, components.thermal
local R, alpha, k, ratio, d, T0 = 1, 3.9e-3, 0.05, 50, 20, 293.15

local m = model { V = e.source{ v = 24 }, winding = h.heating_resistor{ R = R, alpha = alpha, Tref = T0 },
  M = r.dc_motor{ R = 0.01, L = 1e-3, k = k }, rotor = r.inertia{ J = 1e-4 }, gear = r.gear{ ratio = ratio },
  load = r.inertia{ J = 2, phi0 = 0, w0 = 0 }, drag = r.damper{ d = d }, housing = r.fixed{},
    gnd = e.ground{},
  copper = h.capacity{ C = 50, T0 = T0 }, cooling = h.conductor{ G = 4 }, air = h.temperature{ T = T0 },
  connect("V.p", "winding.p"), connect("winding.n", "M.p"), connect("M.n", "V.n", "gnd.p"),
  connect("M.flange", "rotor.flange", "gear.a"), connect("gear.b", "load.flange", "drag.b"),
  connect("drag.a", "housing.flange"), connect("winding.port", "copper.port", "cooling.a"),
  connect("cooling.b", "air.port") }
print(("index %d (the rotor follows the load), %d free initial values"):format(m:index(), m:dof()))

local sol = m:integrate{ to = 400, rtol = 1e-8 }
-- current at rest where the winding has this temperature
local function rest(T)
  return 24/(0.01 + R*(1 + alpha*(T - T0)) + (k*ratio)^2/d)
end
local T = T0
for _ = 1, 200 do T = T0 + R*(1 + alpha*(T - T0))*rest(T)^2/4 end
print(("load    %.6f rad/s, at rest by hand %.6f"):format(sol(m.load.w, 400), k*ratio*rest(T)/d))
print(("winding %.3f K, at rest by hand %.3f"):format(sol(m.copper.T, 400), T))
print(("current %.4f A cold, %.4f A warm"):format(sol(m.M.i, 2), sol(m.M.i, 400)))
