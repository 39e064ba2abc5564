-- Bodies in space against closed solutions: pendulums on every joint, free bodies, tops.
local e = components.spatial
local tight = 1e-9

local function run(x, to, fix)
  local low = x:reduce()
  return low:integrate{ start = low:init{ fix = fix }, to = to, rtol = tight, atol = tight }
end

local function hung(joint, d, J, m)
  return model { w = e.fixed{}, j = joint, R = e.rod{ d = d }, B = e.body{ m = m or 1, J = J },
    connect("w.frame", "j.a"), connect("j.b", "R.a"), connect("R.b", "B.frame") }
end

-- The physical pendulum J φ″ = -m g l sin φ.
local function pendulum(J, m, l, angle, to)
  local phi = var "phi"
  local h = dae { J*der(phi, 2) ~ -m*9.81*l*sin(phi) }
  return h:integrate{ start = { phi = angle, ["phi'"] = 0 }, to = to, rtol = tight, atol = tight }(phi, to)
end

local turned = { x = function(a) return { math.cos(a/2), math.sin(a/2), 0, 0 } end,
  y = function(a) return { math.cos(a/2), 0, math.sin(a/2), 0 } end,
  z = function(a) return { math.cos(a/2), 0, 0, math.sin(a/2) } end }

for axis, moment in pairs { x = 0.2, y = 0.5 } do
  for _, joint in ipairs { e.revolute{ axis = axis }, e.universal{}, e.spherical{} } do
    local name = tostring(joint):match "%a+"
    test(("%s: a physical pendulum about %s"):format(name, axis), function()
      local m, l, angle = 3, 0.7, 0.8
      local x = hung(joint, { 0, 0, -l }, { 0.2, 0.5, 0.4 }, m)
      expect(x:dof()):equals(({ revolute = 2, universal = 4, spherical = 6 })[name])
      local sol = run(x, 2, { ["B.q"] = turned[axis](angle), ["B.w"] = { 0, 0, 0 } })
      local phi = pendulum(moment + m*l^2, m, l, angle, 2)
      expect(sol(x.B.r[3], 2)):near(-l*math.cos(phi), 1e-6)
      expect(sol(axis == "x" and x.B.r[2] or x.B.r[1], 2)):near((axis == "x" and 1 or -1)*l*math.sin(phi),
        1e-6)
      expect(sol(x.B.energy, 2)):near(sol(x.B.energy, 0), 1e-6)
    end)
  end
end

test("revolute about z: gravity does nothing, the angle grows evenly", function()
  local x = hung(e.revolute{ axis = "z" }, { 2, 0, 0 }, { 1, 2, 3 })
  local sol = run(x, 3, { ["B.q"] = { 1, 0, 0, 0 }, ["B.w"] = { 0, 0, 1.5 } })
  expect(sol(x.B.r[1], 3)):near(2*math.cos(4.5), 1e-6)
  expect(sol(x.B.r[2], 3)):near(2*math.sin(4.5), 1e-6)
end)

test("prismatic: falls along its axis, is held across it", function()
  for k, axis in ipairs { "x", "y", "z" } do
    local x = model { w = e.fixed{}, j = e.prismatic{ axis = axis }, B = e.body{ m = 2 },
      F = e.force{ f = { 3, 4, 5 } },
      connect("w.frame", "j.a"), connect("j.b", "B.frame", "F.frame") }
    local sol = run(x, 2, { ["B.r"] = { 0, 0, 0 }, ["B.r'"] = { 0, 0, 0 } })
    local force = ({ 3, 4, 5 - 2*9.81 })[k]
    for i = 1, 3 do expect(sol(x.B.r[i], 2)):near(i == k and force/2*2^2/2 or 0, 1e-6) end
    expect(x:dof()):equals(2)
  end
end)

test("a free asymmetric body keeps energy and angular momentum in space; about its middle axis it turns "
  .. "over", function()
  local J = { 1, 2, 3 }
  local x = model { B = e.body{ J = J, g = 0 }, connect "B.frame" }
  local sol = run(x, 20, { ["B.r"] = { 0, 0, 0 }, ["B.r'"] = { 1, 0, 0 }, ["B.q"] = { 1, 0, 0, 0 },
    ["B.w"] = { 0.01, 1, 0.01 } })
  local H = e.rotation(x.B.q)*vec { J[1]*x.B.w[1], J[2]*x.B.w[2], J[3]*x.B.w[3] }
  expect(sol(H, 20)):near(sol(H, 0), 1e-6)
  expect(sol(x.B.energy, 20)):near(sol(x.B.energy, 0), 1e-6)
  local least = 1
  for k = 0, 200 do least = math.min(least, sol(x.B.w[2], k/10)) end
  expect(least < -0.99):is_true()
end)

test("a free symmetric body: its speed of turning circles about the axis with (J3 - J1)/J1 w3", function()
  local x = model { B = e.body{ J = { 2, 2, 5 }, g = 0 }, connect "B.frame" }
  local sol = run(x, 4, { ["B.r"] = { 0, 0, 0 }, ["B.r'"] = { 0, 0, 0 }, ["B.q"] = { 1, 0, 0, 0 },
    ["B.w"] = { 0.3, 0, 0.8 } })
  local rate = (5 - 2)/2*0.8
  expect(sol(x.B.w[1], 4)):near(0.3*math.cos(4*rate), 1e-6)
  expect(sol(x.B.w[2], 4)):near(0.3*math.sin(4*rate), 1e-6)
  expect(sol(x.B.w[3], 4)):near(0.8, 1e-6)
end)

test("a horizontal top precesses with m g l/(J3 w3)", function()
  local m, l, J3, spin = 2, 0.5, 0.3, 40
  local rate = m*9.81*l/(J3*spin)
  local x = hung(e.spherical{}, { l, 0, 0 }, { J3, 0.2, 0.2 }, m)
  local sol = run(x, 1, { ["B.q"] = { 1, 0, 0, 0 }, ["B.w"] = { spin, 0, rate } })
  expect(sol(x.B.r[1], 1)):near(l*math.cos(rate), 1e-5)
  expect(sol(x.B.r[2], 1)):near(l*math.sin(rate), 1e-5)
  expect(sol(x.B.r[3], 1)):near(0, 1e-5)
end)

test("a sleeping top turns upright with m g l and without nutation", function()
  local x = hung(e.spherical{}, { 0, 0, 0.5 }, { 0.2, 0.2, 0.3 }, 2)
  local sol = run(x, 2, { ["B.q"] = { 1, 0, 0, 0 }, ["B.w"] = { 0, 0, 50 } })
  expect(sol(x.B.r[3], 2)):near(0.5, 1e-8)
  expect(sol(x.B.w[3], 2)):near(50, 1e-6)
end)

test("bodies that are rigidly joined are one body: rods, welds, a common frame", function()
  local J = { 0.1, 0.1, 0.1 }
  local dumbbell = model { A = e.body{ m = 1, J = J }, R = e.rod{ d = { 2, 0, 0 } }, B = e.body{ m = 3,
    J = J },
    connect("A.frame", "R.a"), connect("R.b", "B.frame") }
  expect(dumbbell:dof()):equals(12)
  local sol = run(dumbbell, 1, { ["A.r"] = { -1.5, 0, 0 }, ["A.r'"] = { 0, -1.5, 0 }, ["A.q"] = { 1, 0, 0,
    0 },
    ["A.w"] = { 0, 0, 1 } })
  expect(sol(dumbbell.B.r, 1)):near(vec { 0.5*math.cos(1), 0.5*math.sin(1), -9.81/2 }, 1e-6)
  local both = model { A = e.body{ m = 1, J = J }, B = e.body{ m = 3, J = J }, C = e.body{ m = 2, J = J },
    W = e.weld{},
    connect("A.frame", "B.frame", "W.a"), connect("W.b", "C.frame") }
  expect(both:dof()):equals(12)
  local stood = model { w = e.fixed{}, A = e.body{ m = 1 }, R = e.rod{}, B = e.body{ m = 3 },
    connect("w.frame", "A.frame", "R.a"), connect("R.b", "B.frame") }
  expect(stood:dof()):equals(0)
  local at = stood:dae():init{}
  expect(at(stood.w.frame.f[3])):near(-4*9.81, 1e-9)
end)

test("a spring between two free bodies swings with the reduced mass", function()
  local x = model { A = e.body{ m = 1, g = 0 }, B = e.body{ m = 3, g = 0 }, c = e.spring{ k = 3, s0 = 1 },
    connect("A.frame", "c.a"), connect("c.b", "B.frame") }
  local sol = run(x, 1, { ["A.r"] = { 0, 0, 0 }, ["A.r'"] = { 0, 0, 0 }, ["B.r"] = { 2, 0, 0 },
    ["B.r'"] = { 0, 0, 0 },
    ["A.q"] = { 1, 0, 0, 0 }, ["A.w"] = { 0, 0, 0 }, ["B.q"] = { 1, 0, 0, 0 }, ["B.w"] = { 0, 0, 0 } })
  expect(sol(x.c.s, 1)):near(1 + math.cos(2), 1e-6)         -- w² = k (1/m1 + 1/m2) = 4
end)

test("a frame at rest may be turned", function()
  local x = model { w = e.fixed{ q = turned.y(math.pi/2) }, j = e.prismatic{ axis = "x" }, B = e.body{},
    connect("w.frame", "j.a"), connect("j.b", "B.frame") }
  local sol = run(x, 1, { ["B.r"] = { 0, 0, 0 }, ["B.r'"] = { 0, 0, 0 } })
  expect(sol(x.B.r[3], 1)):near(-9.81/2, 1e-6)             -- its x axis points down
end)
