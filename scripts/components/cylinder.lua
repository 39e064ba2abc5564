-- A hydraulic cylinder: a servo valve opens half at 0.1 s and closes at 0.4 s; oil is compressible.
local h, l = components.hydraulic, components.translational
local drive = model {
  P = h.ambient{ p = 1e7 }, T = h.ambient{}, V = h.servo_valve{ K = 1e-7 },
  C = h.cylinder{ A = 2e-3, Ab = 1e-3 }, load = l.mass{ m = 100, s0 = 0, v0 = 0 },
  d = l.damper{ d = 2000 }, w = l.fixed{},
  connect("V.u", ifelse(lt(t, 0.1), 0, ifelse(lt(t, 0.4), 0.5, 0))),
  connect("P.port", "V.supply"), connect("T.port", "V.tank"), connect("V.a", "C.a"), connect("V.b", "C.b"),
  connect("C.rod", "load.flange", "d.b"), connect("w.flange", "d.a") }
print(("index %d, %d free initial values"):format(drive:index(), drive:dof()))
local sol = drive:integrate{ to = 0.6, rtol = 1e-8 }
-- in steady flow each edge of the valve carries the flow of its side
local K, ps, Aa, Ab, u, d = 1e-7, 1e7, 2e-3, 1e-3, 0.5, 2000
local function balance(v)                            -- pressures from the edges, then the force
  local pa, pb = ps - (Aa*v/(K*u))^2, (Ab*v/(K*u))^2
  return Aa*pa - Ab*pb - d*v
end
local low, high = 0, 1
for _ = 1, 60 do
  local mid = (low + high)/2
  if balance(mid) > 0 then low = mid else high = mid end
end
print(("speed while it is open: %.5f m/s (steady flow by hand %.5f)"):format(sol(drive.load.v, 0.39), low))
print(plot(sol, { drive.C.pa, drive.C.pb }))
