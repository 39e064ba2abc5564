-- A drive train: motor, clutch, gear and load. The clutch closes at 0.5 s, slides, then holds.
local r = components.rotational

local train = model {
  motor = r.inertia{ J = 0.5, phi0 = 0, w0 = 100 }, load = r.inertia{ J = 2, phi0 = 0, w0 = 0 },
  clutch = r.clutch{ tau0 = 100, mode0 = -1 }, brake = r.damper{ d = 0 }, wall = r.fixed{},
  connect("clutch.u", ifelse(lt(t, 0.5), 0, 1)),
  connect("motor.flange", "clutch.a"), connect("clutch.b", "load.flange", "brake.a"),
  connect("brake.b", "wall.flange") }

local sol = train:integrate{ to = 2, rtol = 1e-8 }
local m, c = train.motor, train.load
print(("before the clutch closes: motor %.4f rad/s"):format(sol(m.w, 0.4)))
-- slides with 100 N m: w_motor = 100 - 200 t, w_load = 50 t until both are 20
print(("0.2 s later:              motor %.4f, load %.4f (60 and 10 by hand)"):format(sol(m.w, 0.7),
  sol(c.w, 0.7)))
print(("after it holds:           motor %.4f, load %.4f (20 by hand)"):format(sol(m.w, 1.5), sol(c.w, 1.5)))
print(("angular momentum:         %.6f of 50"):format(sol(m.J*m.w + c.J*c.w, 2)))
print(("mode of the clutch:       %g (0: it holds)"):format(sol(train.clutch.mode, 2)))
