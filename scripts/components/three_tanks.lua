-- Three tanks in a row with orifices between them and an outlet: the laboratory plant DTS 200.
local h = components.hydraulic

local plant = model {
  pump = h.pump{ q = 3e-5 }, air = h.ambient{}, drain = h.ambient{},
  T1 = h.tank{ A = 0.0154, h0 = 0.4 }, T2 = h.tank{ A = 0.0154, h0 = 0.2 },
    T3 = h.tank{ A = 0.0154, h0 = 0.3 },
  v13 = h.orifice{ A = 5e-5, Cd = 0.5 }, v32 = h.orifice{ A = 5e-5, Cd = 0.5 },
    v20 = h.orifice{ A = 5e-5, Cd = 0.6 },
  connect("air.port", "pump.a"), connect("pump.b", "T1.port", "v13.a"), connect("v13.b", "T3.port", "v32.a"),
  connect("v32.b", "T2.port", "v20.a"), connect("v20.b", "drain.port") }

print(("index %d, %d free initial values"):format(plant:index(), plant:dof()))
local sol = plant:integrate{ to = 4000, rtol = 1e-8 }
for _, tank in ipairs { "T1", "T3", "T2" } do print(("%s: %.6f m"):format(tank, sol(plant[tank].h, 4000))) end
-- at rest each orifice carries the pump's flow: h = (q/(Cd A))²/(2 g) over the next level
local head = (3e-5/(0.5*5e-5))^2/(2*9.81)
local out = (3e-5/(0.6*5e-5))^2/(2*9.81)
print(("T1 at 200 s: %.9f m (scipy, equations by hand: 0.332417712)"):format(sol(plant.T1.h, 200)))
print(("at rest: T2 = %.6f, T3 = %.6f, T1 = %.6f"):format(out, out + head, out + 2*head))
