-- Double wishbone suspension in the plane: two links between chassis and wheel carrier, a spring and damper.
local p = components.planar
local function link(x, y) return p.rod{ dx = x, dy = y } end
local axle = model {
  L = p.fixed{}, U = p.fixed{ x = 0.1, y = 0.3 },
  jL = p.revolute{ phi0 = 0, w0 = 0 }, lower = link(0.4, 0), jC = p.revolute{}, low = link(0, 0.15),
  carrier = p.body{ m = 20, J = 0.5 }, up = link(0, 0.15), jD = p.revolute{}, jU = p.revolute{},
    upper = link(0.3, 0),
  seat = p.fixed{ x = 0.1, y = 0.6 }, strut = p.spring{ k = 2e4, d = 1500, s0 = 0.65 },
  connect("L.frame", "jL.a"), connect("jL.b", "lower.a"), connect("lower.b", "jC.a"),
    connect("jC.b", "low.a"),
  connect("low.b", "carrier.frame", "up.a", "strut.b"), connect("seat.frame", "strut.a"),
  connect("up.b", "jD.b"), connect("U.frame", "jU.a"), connect("jU.b", "upper.a"),
    connect("upper.b", "jD.a") }
print(("%d equations, %d after elimination, %d free initial values"):format(#axle:flat().equations,
  #axle:dae().equations,
  axle:dae():dof()))
local low = axle:reduce()
local at = low:init{ guess = { ["jC.phi"] = 0, ["jU.phi"] = 0, ["jD.phi"] = 0 } }
local sol = low:integrate{ start = at, to = 3, rtol = 1e-9, atol = 1e-9 }
print(("at 0.2 s: %.8f m (scipy, equations by hand: -0.00953850)"):format(sol(axle.carrier.y, 0.2)))
print(("height of the wheel carrier at rest: %.6f m"):format(sol(axle.carrier.y, 3)))
local D = axle.jD.a
print(("length of the upper link: %.9f"):format(math.sqrt((sol(D.x, 3) - 0.1)^2 + (sol(D.y, 3) - 0.3)^2)))
