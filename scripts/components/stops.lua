-- Two-mass oscillator: a hammer between stops strikes a mass on a spring. Impacts with restitution, and
-- elastic ones.
local l = components.translational

local rigid = model {
  hammer = l.mass_with_stops{ m = 1, smin = -1, smax = 1, e = 0.5, v0 = 2 }, connect("hammer.flange") }
local sol = rigid:integrate{ to = 3 }
-- 1 m at 2 m/s, 2 m at 1 m/s, then 0.5 m/s
print(("impacts with restitution 1/2: s(3) = %.6f, v(3) = %.6f (by hand -0.75, 0.5)"):format(
  sol(rigid.hammer.s, 3),
  sol(rigid.hammer.v, 3)))

local soft = model {
  a = l.mass{ m = 1, s0 = -1, v0 = 1 }, b = l.mass{ m = 2, s0 = 1, v0 = 0 },
    gap = l.stop{ k = 1e4, d = 0, s0 = 0 },
  connect("a.flange", "gap.a"), connect("gap.b", "b.flange") }
local hit = soft:integrate{ to = 4, rtol = 1e-9 }
-- elastic collision of 1 kg and 2 kg: -1/3 and 2/3
print(("elastic collision: v_a = %.6f, v_b = %.6f (by hand -0.333333, 0.666667)"):format(hit(soft.a.v, 4),
  hit(soft.b.v, 4)))
print(("momentum %.9f, energy %.9f"):format(hit(soft.a.v + 2*soft.b.v, 4),
  hit(soft.a.energy + soft.b.energy, 4)))
