-- A quarter of a car over a kerb of 0.1 m: a tyre that can lift off, a spring and damper, a bump stop.
local l = components.translational
local mb, mw, ks, kt, g = 300, 40, 1.5e4, 1.6e5, 9.81
local sag = (mb + mw)*g/kt                             -- of the tyre, at rest
local car = model {
  body = l.mass{ m = mb, s0 = -sag - mb*g/ks, v0 = 0 }, wheel = l.mass{ m = mw, s0 = -sag, v0 = 0 },
  G1 = l.force{ f = -mb*g }, G2 = l.force{ f = -mw*g }, strut = l.spring_damper{ k = ks, d = 1200 },
  bump = l.stop{ k = 2e5, d = 0, s0 = -0.25 }, tyre = l.stop{ k = kt, d = 0 }, road = l.position{ s = 0.1 },
  connect("wheel.flange", "strut.a", "bump.a", "tyre.b", "G2.flange"),
  connect("body.flange", "strut.b", "bump.b", "G1.flange"), connect("road.flange", "tyre.a") }
local sol = car:integrate{ to = 3, rtol = 1e-9, atol = 1e-11 }
print(("body at 1 s:  %.9f m (scipy, equations by hand: -0.132277718)"):format(sol(car.body.s, 1)))
print(("wheel at 1 s: %.9f m (scipy, equations by hand:  0.079308142)"):format(sol(car.wheel.s, 1)))
print(("body at rest: %.6f m (by hand %.6f)"):format(sol(car.body.s, 3), 0.1 - sag - mb*g/ks))
print(plot(sol, { car.body.s, car.wheel.s }, { xlim = { 0, 2 } }))
