-- A DC motor with a load and a PID controller of its speed; the output of the controller is limited.
local e, r, s = components.electrical, components.rotational, components.signals

local drive = model {
  pid = s.pid{ k = 0.5, Ti = 0.2, low = -24, high = 24 }, V = e.signal_source{},
    M = r.dc_motor{ R = 1, L = 1e-3, k = 0.1 },
  J = r.inertia{ J = 1e-3, phi0 = 0, w0 = 0 }, w = r.speed_sensor{}, gnd = e.ground{},
  connect("pid.r", 150), connect("w.w", "pid.v"), connect("pid.y", "V.v"),
  connect("V.p", "M.p"), connect("V.n", "M.n", "gnd.p"), connect("M.flange", "J.flange", "w.flange") }

print(drive:tree())
print(("index %d, %d free initial values; %d equations, %d after elimination"):format(drive:index(),
  drive:dof(),
  #drive:flat().equations, #drive:dae().equations))
local sol = drive:integrate{ to = 3, rtol = 1e-8 }
print(("speed at 0.1 s %.4f, at 3 s %.4f; voltage at 3 s %.4f = k w"):format(sol(drive.J.w, 0.1),
  sol(drive.J.w, 3),
  sol(drive.V.v, 3)))

-- by hand
local i, w, z = vars "i w z"
local error = 150 - w
local u = min(24, max(-24, 0.5*error + z))
local hand = dae { 1e-3*der(i) ~ u - i - 0.1*w, 1e-3*der(w) ~ 0.1*i,
  der(z) ~ 0.5/0.2*error + (u - 0.5*error - z)/0.2 }
local other = hand:integrate{ start = { i = 0, w = 0, z = 0 }, to = 3, rtol = 1e-8 }
print(("difference to the equations by hand: %.0e"):format(math.max(1e-6,
  math.abs(other(w, 0.1) - sol(drive.J.w, 0.1)))))
