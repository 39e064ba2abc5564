-- Closed loops of bodies in the plane and in space: degrees of freedom by Grübler's count, energy kept, loops
-- that stay closed; random lengths and masses.
local p, s = components.planar, components.spatial
local random = math.random
local function number() return 0.8 + random()/2 end

-- A four-bar linkage of three moving bodies: crank a from the ground, coupler b, rocker c back to the ground
-- at d.
local function four_bar(a, b, c, d, masses)
  local function arm(length) return p.rod{ dx = length/2 } end
  return model { G = p.fixed{}, H = p.fixed{ x = d }, j1 = p.revolute{ phi0 = 1.2, w0 = 2 },
    j2 = p.revolute{},
    j3 = p.revolute{}, j4 = p.revolute{}, a1 = arm(a), a2 = arm(a), b1 = arm(b), b2 = arm(b), c1 = arm(c),
    c2 = arm(c), A = p.body{ m = masses[1], J = 0.1 }, B = p.body{ m = masses[2], J = 0.2 },
    C = p.body{ m = masses[3], J = 0.1 }, connect("G.frame", "j1.a"), connect("j1.b", "a1.a"),
    connect("a1.b", "A.frame", "a2.a"), connect("a2.b", "j2.a"), connect("j2.b", "b1.a"),
    connect("b1.b", "B.frame", "b2.a"), connect("b2.b", "j3.a"), connect("j3.b", "c1.a"),
    connect("c1.b", "C.frame", "c2.a"), connect("c2.b", "j4.a"), connect("j4.b", "H.frame") }
end

for seed = 1, 3 do
  test(("four-bar linkage, seed %d: one degree of freedom, energy, closure"):format(seed), function()
    math.randomseed(seed)
    local a, b, c = 0.5*number(), 2*number(), 1.5*number()
    local d = (b + c)/1.6
    local m = four_bar(a, b, c, d, { number(), number(), number() })
    local low = m:reduce()
    local at = low:init{ guess = { ["j2.phi"] = -0.8, ["j3.phi"] = -1.8, ["j4.phi"] = 1 } }
    expect(m:dae():dof()):equals(2)
    local sol = low:integrate{ start = at, to = 1, rtol = 1e-9, atol = 1e-9 }
    expect(sol.status):equals "finished"
    local energy = m.A.energy + m.B.energy + m.C.energy
    expect(sol(energy, 1)):near(sol(energy, 0), 1e-6)
    local x, y = a*cos(m.j1.phi), a*sin(m.j1.phi)
    local turn = m.j1.phi + m.j2.phi
    x, y = x + b*cos(turn), y + b*sin(turn)
    local angle = turn + m.j3.phi
    expect(sol((x + c*cos(angle) - d)^2 + (y + c*sin(angle))^2, 0.7)):near(0, 1e-12)
  end)
end

test("a hinge and two ball joints close a loop in space: one degree of freedom, energy kept", function()
  -- A hangs on a hinge, B on a ball joint beside it; an arm of B ends in a ball joint at A: 12 - 5 - 3 - 3 =
  -- 1,
  -- B swings about the line through its two joints
  for _, arm in ipairs { 1, 0.9, 1.2 } do
    local m = model { g1 = s.fixed{}, g2 = s.fixed{ r = { arm, 0, 0 } }, b1 = s.revolute{ axis = "y" },
      b2 = s.spherical{}, b3 = s.spherical{}, r1 = s.rod{ d = { 0, 0, -1 } }, r2 = s.rod{ d = { 0, 0, -1 } },
      A = s.body{ m = 2, J = { 0.1, 0.1, 0.1 } }, B = s.body{ m = 1, J = { 0.1, 0.2, 0.3 } },
      link = s.rod{ d = { -arm, 0, 0 } }, connect("g1.frame", "b1.a"), connect("b1.b", "r1.a"),
      connect("r1.b", "A.frame", "b3.a"), connect("b3.b", "link.b"), connect("g2.frame", "b2.a"),
      connect("b2.b", "r2.a"), connect("r2.b", "B.frame", "link.a") }
    expect(m:dof()):equals(2)
    local low = m:reduce()
    local at = low:init{ guess = { ["A.r"] = { 0, 0, -1 }, ["A.q"] = { 1, 0, 0, 0 }, ["B.q"] = { 1, 0, 0, 0 },
      ["B.r"] = { arm, 0, -1 }, ["B.r'"] = { 0, 0.3, 0 }, ["B.q'"] = { 0, 0.2, 0, 0.2 } } }
    local sol = low:integrate{ start = at, to = 0.4, rtol = 1e-8, atol = 1e-9 }
    expect(sol.status):equals "finished"
    local energy = m.A.energy + m.B.energy
    expect(sol(energy, 0.4)):near(sol(energy, 0), 1e-5)
  end
end)
