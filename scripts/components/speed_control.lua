-- Two inertias and an elastic shaft, their speed by a PI controller whose torque has a limit: PID_Controller
-- of physical modelling libraries. The reference goes up and down again as a trapezium.
local r, s = components.rotational, components.signals
local reference = max(0, min(1, min(2*(t - 0.5), 2*(3.5 - t))))

local m = model { J1 = r.inertia{ J = 1, phi0 = 0, w0 = 0 }, J2 = r.inertia{ J = 2, phi0 = 0, w0 = 0 },
  shaft = r.spring_damper{ c = 1e4, d = 100 }, drive = r.signal_torque{}, load = r.torque{ tau = -3 },
  speed = r.speed_sensor{}, control = s.pid{ k = 100, Ti = 0.1, low = -12, high = 12 },
  connect("drive.flange", "J1.flange", "shaft.a", "speed.flange"),
  connect("shaft.b", "J2.flange", "load.flange"), connect("control.y", "drive.tau"),
  connect("speed.w", "control.v"), connect(reference, "control.r") }

local sol = m:integrate{ to = 4, rtol = 1e-8 }
print(("index %d, %d free initial values"):format(m:index(), m:dof()))
for _, time in ipairs { 0.5, 0.75, 1, 2, 3.25, 4 } do
  print(("%4.2f s: speed %8.5f, reference %.2f, torque %8.4f"):format(time, sol(m.J2.w, time),
    evaluate(reference, { t = time }), sol(m.drive.tau, time)))
end
print "at rest the torque is that of the load, 3; while the speed rises with 2 rad/s2, 3 + (1 + 2) 2 = 9"
