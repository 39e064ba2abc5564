-- The woodpecker toy: a sleeve that tilts, jams on its pole and lets go again, and a bird on a spring. After
-- Eich-Soellner & Führer, Numerical Methods in Multibody Dynamics, 1998, with their states.
z, p, b, vz, vp, vb, jammed = vars "z p b vz vp vb jammed"      -- height, angles of sleeve and bird
edge, pole = vars "edge pole"                                   -- forces while the sleeve is jammed
mS, JS, mB, JB, c, g = 3e-4, 5e-9, 4.5e-3, 7e-7, 5.6e-3, 9.81
r0, rS, hS, lS, lG, hB, lB = 2.5e-3, 3.1e-3, 5.8e-3, 1e-2, 1.5e-2, 2e-2, 2.01e-2
limit, beak = (rS - r0)/hS, (lS + lG - lB - r0)/hB

-- one model, two regimes: a free sleeve has index 1, a jammed one index 2
free = lt(jammed, 0.5)
toy = dae { der(z) ~ vz, der(p) ~ vp, der(b) ~ vb, der(jammed) ~ 0,
  (mS + mB)*der(vz) + mB*lS*der(vp) + mB*lG*der(vb) ~ -(mS + mB)*g - pole,
  mB*lS*der(vz) + (JS + mB*lS^2)*der(vp) + mB*lS*lG*der(vb) ~ c*(b - p) - mB*lS*g - hS*edge - rS*pole,
  mB*lG*der(vz) + mB*lS*lG*der(vp) + (JB + mB*lG^2)*der(vb) ~ c*(p - b) - mB*lG*g,
  0 ~ ifelse(free, edge, vp), 0 ~ ifelse(free, pole, vz) }

-- jammed on either side (the bird keeps its angular momentum), free again, pecking
jam = { [vz] = 0, [vp] = 0, [vb] = vb + mB*lG*(vz + lS*vp)/(JB + mB*lG^2), [jammed] = 1 }
away = 10*jammed                                                -- no second time while it is jammed
run = toy:integrate { start = { z = 0, p = -limit, b = -5*limit, vz = 0, vp = 0, vb = 0, jammed = 1 },
  to = 1, rtol = 1e-9, atol = 1e-12, events = {
    { when = p + limit + away, direction = -1, reset = jam },
    { when = p - limit - away, direction = 1, reset = jam },
    { when = edge, reset = { [jammed] = 0 } }, { when = b - beak, direction = 1, reset = { [vb] = -vb } } } }
print(run.status)
for k = 1, 7 do print(("%.6f  %s"):format(run:switches()[k].t, run:switches()[k].regime)) end
print(("it pecks its way down: %.1f mm in a second"):format(-1000*run:final(z)))
