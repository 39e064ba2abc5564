-- Planar four-bar linkage: crank, coupler, rocker; a closed loop of four hinges, one degree of freedom.
local p, r = components.planar, components.rotational

local bar = component("bar", { l = 1, m = 1 }, function(self)
  self.a, self.b = p.frame, p.frame
  self.left, self.right = p.rod{ dx = self.l/2 }, p.rod{ dx = self.l/2 }
  self.body = p.body{ m = self.m, J = self.m*self.l^2/12 }
  return { connect(self.a, self.left.a), connect(self.left.b, self.body.frame, self.right.a),
    connect(self.right.b, self.b) }
end, { text = "A slender bar between two frames.", source = "definition" })

local linkage = model {
  A = p.fixed{}, D = p.fixed{ x = 3 }, crank = bar{ l = 1 }, coupler = bar{ l = 3 }, rocker = bar{ l = 2 },
  jA = p.revolute{ phi0 = math.pi/2, w0 = 0 }, jB = p.revolute{}, jC = p.revolute{}, jD = p.revolute{},
  connect("A.frame", "jA.a"), connect("jA.b", "crank.a"), connect("crank.b", "jB.a"),
    connect("jB.b", "coupler.a"),
  connect("coupler.b", "jC.a"), connect("jC.b", "rocker.b"), connect("rocker.a", "jD.b"),
    connect("D.frame", "jD.a") }

print(("%d equations, %d after elimination; %d free initial values"):format(#linkage:flat().equations,
  #linkage:dae().equations, linkage:dae():dof()))
local low = linkage:reduce()
local at = low:init{ guess = { ["jB.phi"] = -1.2, ["jC.phi"] = 1, ["jD.phi"] = 1.5 } }
local energy = linkage.crank.body.energy + linkage.coupler.body.energy + linkage.rocker.body.energy
local sol = low:integrate{ start = at, to = 2, rtol = 1e-9, atol = 1e-9 }
print(sol.status)
print(("energy: %.6f at the start, %.6f at the end"):format(sol(energy, 0), sol(energy, 2)))
local C = linkage.jC.a
print(("length of the rocker at the end: %.9f"):format(math.sqrt((sol(C.x, 2) - 3)^2 + sol(C.y, 2)^2)))
