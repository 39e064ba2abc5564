-- Four shafts and three clutches that close one after the other: CoupledClutches of physical modelling
-- libraries. Which clutch slides, and to which side, follows from the speeds.
local r = components.rotational
local f = 0.2                                          -- Hz
local clutch = r.clutch{ tau0 = 10, peak = 1.1 }

local m = model {
  J1 = r.inertia{ phi0 = 0, w0 = 10 }, J2 = r.inertia{ phi0 = 0, w0 = 0 }, J3 = r.inertia{ phi0 = 0, w0 = 0 },
  J4 = r.inertia{ phi0 = 0, w0 = 0 }, T = r.torque{ tau = 10*sin(2*pi*f*t) }, c1 = clutch, c2 = clutch,
  c3 = clutch, connect("T.flange", "J1.flange", "c1.a"), connect("c1.b", "J2.flange", "c2.a"),
  connect("c2.b", "J3.flange", "c3.a"), connect("c3.b", "J4.flange"), connect("c1.u", sin(2*pi*f*t)^2),
  connect("c2.u", ifelse(lt(t, 0.4), 0, 1)), connect("c3.u", ifelse(lt(t, 0.9), 0, 1)) }

local sol = m:integrate{ to = 1.5, rtol = 1e-8 }
print "   t      J1       J2       J3       J4    rad/s    modes"
for _, time in ipairs { 0.25, 0.5, 0.75, 1, 1.25, 1.5 } do
  local function at(e) return sol(e, time) end
  print(("%4.2f %8.4f %8.4f %8.4f %8.4f          %2g %2g %2g"):format(time, at(m.J1.w), at(m.J2.w),
    at(m.J3.w),
    at(m.J4.w), at(m.c1.mode), at(m.c2.mode), at(m.c3.mode)))
end
print "by scipy with tanh(w/1e-4) for the sign:  11.7475, 2.8898 at 1.5 s"
local given = 10 + 10/(2*math.pi*f)*(1 - math.cos(2*math.pi*f*1.5))
print(("angular momentum %.6f, what was given %.6f"):format(sol(m.J1.w + m.J2.w + m.J3.w + m.J4.w, 1.5),
  given))
