-- A planetary gear between a motor, a brake and a load; rigid couplings of inertias disappear.
local r = components.rotational
local box = model { T = r.torque{ tau = 3 }, A = r.inertia{ J = 1, phi0 = 0, w0 = 0 },
  g = r.planetary{ ratio = 2 },
  B = r.inertia{ J = 3 }, C = r.inertia{ J = 2, phi0 = 0, w0 = 0 },
  connect("T.flange", "A.flange", "g.sun"), connect("g.carrier", "B.flange"), connect("g.ring", "C.flange") }
print(("index %d of all equations, %d free initial values"):format(box:index(), box:dof()))
local low = box:reduce()
local sol = low:integrate{ to = 1, rtol = 1e-9 }
-- by hand: w_B = (w_A + 2 w_C)/3; T = A²/2 + 3 w_B²/2 + 2 C²/2; momenta (4/3) a + (2/3) c = 3, (2/3) a +
-- (10/3) c = 0
local a, c = table.unpack { 3*(10/3)/((4/3)*(10/3) - 4/9), -3*(2/3)/((4/3)*(10/3) - 4/9) }
print(("speeds at 1: sun %.6f, ring %.6f, carrier %.6f"):format(sol(box.A.w, 1), sol(box.C.w, 1),
  sol(box.B.w, 1)))
print(("by hand:     sun %.6f, ring %.6f, carrier %.6f"):format(a, c, (a + 2*c)/3))
