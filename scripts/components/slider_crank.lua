-- Slider crank: a crank, a connecting rod and a piston.
local p = components.planar
local engine = model {
  A = p.fixed{}, jA = p.revolute{ phi0 = math.pi/4, w0 = 10 }, crank = p.rod{ dx = 1 },
    disc = p.body{ m = 1, J = 1, g = 0 },
  jB = p.revolute{}, rod = p.rod{ dx = 2 }, jC = p.revolute{}, piston = p.body{ m = 1, J = 1, g = 0 },
  slide = p.prismatic{ nx = 1 },
  connect("A.frame", "jA.a", "slide.a"), connect("jA.b", "disc.frame", "crank.a"), connect("crank.b", "jB.a"),
  connect("jB.b", "rod.a"), connect("rod.b", "jC.a"), connect("jC.b", "slide.b", "piston.frame") }
local low = engine:reduce()
local at = low:init{ guess = { ["jB.phi"] = -1.1, ["slide.s"] = 2.6 } }
local sol = low:integrate{ start = at, to = 1, rtol = 1e-9, atol = 1e-9 }
local phi = sol(engine.jA.phi, 1)
print(("%d free initial values"):format(engine:dae():dof()))
print(("piston at 1: %.6f, by geometry %.6f"):format(sol(engine.slide.s, 1),
  math.cos(phi) + math.sqrt(4 - math.sin(phi)^2)))
print(("energy: %.6f, %.6f"):format(sol(engine.disc.energy + engine.piston.energy, 0),
  sol(engine.disc.energy + engine.piston.energy, 1)))
