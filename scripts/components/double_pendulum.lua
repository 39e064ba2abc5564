-- A double pendulum of planar parts: open chains become ordinary equations in the angles of their joints.
local p = components.planar
local chain = model { A = p.fixed{}, j1 = p.revolute{ phi0 = 0, w0 = 0 }, r1 = p.rod{ dx = 1 },
  b1 = p.body{ m = 1, J = 0 },
  j2 = p.revolute{ phi0 = 1, w0 = 0 }, r2 = p.rod{ dx = 1 }, b2 = p.body{ m = 1, J = 0 },
  connect("A.frame", "j1.a"), connect("j1.b", "r1.a"), connect("r1.b", "b1.frame", "j2.a"),
    connect("j2.b", "r2.a"),
  connect("r2.b", "b2.frame") }
print(("%d equations, index %d; %d equations of index %d after elimination, %d free initial values"):format(
  #chain:flat().equations, chain:index(), #chain:dae().equations, chain:dae():index(), chain:dae():dof()))
local sol = chain:integrate{ to = 2, rtol = 1e-10, atol = 1e-10 }

-- the same by Lagrange
local a, b = vars "a b"
local T = (a.dot^2 + (a.dot^2 + (a.dot + b.dot)^2 + 2*a.dot*(a.dot + b.dot)*cos(b)))/2
local V = 9.81*(2*sin(a) + sin(a + b))
local hand = lagrange{ q = { a, b }, T = T, V = V }:integrate{
  start = { a = 0, b = 1, ["a'"] = 0, ["b'"] = 0 }, to = 2, rtol = 1e-10, atol = 1e-10 }
print(("angles at 2: %.6f %.6f, by Lagrange %.6f %.6f"):format(sol(chain.j1.phi, 2), sol(chain.j2.phi, 2),
  hand(a, 2), hand(b, 2)))
local E = chain.b1.energy + chain.b2.energy
print(("energy: %.6f %.6f"):format(sol(E, 0), sol(E, 2)))
