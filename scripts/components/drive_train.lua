-- A drive train: motor, clutch, gear and load. The clutch closes at 0.5 s, slides, then holds.
local r = components.rotational

local close = component("close", { at = 1 }, function(self)        -- a valve: 0, from a time on 1
  local y = self:discrete("y", 0)
  self:gives(y)
  self:event { when = t - self.at, direction = 1, reset = { [y] = 1 } }
end)

local train = model {
  motor = r.inertia{ J = 0.5, phi0 = 0, w0 = 100 }, load = r.inertia{ J = 2, phi0 = 0, w0 = 0 },
  clutch = r.clutch{ tau0 = 100, mode0 = -1 }, valve = close{ at = 0.5 }, connect("valve.y", "clutch.u"),
  connect("motor.flange", "clutch.a"), connect("clutch.b", "load.flange") }

local sol = train:integrate{ to = 2, rtol = 1e-8 }
local m, c = train.motor, train.load
print(("before the clutch closes: motor %.4f rad/s"):format(sol(m.w, 0.4)))
-- slides with 100 N m: w_motor = 100 - 200 t, w_load = 50 t until both are 20
print(("0.2 s later:              motor %.4f, load %.4f (60 and 10 by hand)"):format(sol(m.w, 0.7),
  sol(c.w, 0.7)))
print(("after it holds:           motor %.4f, load %.4f (20 by hand)"):format(sol(m.w, 1.5), sol(c.w, 1.5)))
print(("angular momentum:         %.6f of 50"):format(sol(m.J*m.w + c.J*c.w, 2)))
print(("mode of the clutch:       %g (0: it holds)"):format(sol(train.clutch.mode, 2)))
