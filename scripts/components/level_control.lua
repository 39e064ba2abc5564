-- A PI controller holds the level of a tank with a pump that has a limit; the outlet opens wider at 1500 s.
local w, s = components.hydraulic, components.signals

local m = model { well = w.ambient{}, pump = w.signal_pump{}, tank = w.tank{ A = 1, h0 = 0 },
  air = w.ambient{},
  valve = w.valve{ K = 5e-5 }, control = s.pid{ k = 0.05, Ti = 50, low = 0, high = 0.01 },
  connect("well.port", "pump.a"), connect("pump.b", "tank.port", "valve.a"), connect("valve.b", "air.port"),
  connect("valve.open", ifelse(lt(t, 1500), 0.5, 1)), connect("control.r", 1),
  connect(var "tank.h", "control.v"), connect("control.y", "pump.q") }

local sol = m:integrate{ to = 3000, rtol = 1e-8 }
local root = math.sqrt(1000*9.81)                       -- of the pressure at 1 m
print(("level %.6f m, flow %.6f m3/s (by hand %.6f)"):format(sol(m.tank.h, 1500), sol(m.pump.q, 1500),
  0.5*5e-5*root))
print(("level %.6f m, flow %.6f m3/s (by hand %.6f)"):format(sol(m.tank.h, 3000), sol(m.pump.q, 3000),
  5e-5*root))
local most = 0
for k = 0, 1500 do most = math.max(most, sol(m.tank.h, k)) end
print(("highest level %.3f m: the integral follows the limit of the pump"):format(most))
