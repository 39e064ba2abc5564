-- Elimination leaves what one would write by hand, and takes time in proportion to the number of parts.
local e, h = components.electrical, components.thermal

local function ladder(n)
  local R, L, C, list, low = {}, {}, {}, {}, { "V.n", "gnd.p" }
  for k = 1, n do
    R[k], L[k], C[k] = e.resistor{}, e.inductor{ i0 = 0 }, e.capacitor{ v0 = 0 }
    list[#list + 1] = connect(("R[%d].n"):format(k), ("L[%d].p"):format(k))
    local node = { ("L[%d].n"):format(k), ("C[%d].p"):format(k) }
    if k < n then node[3] = ("R[%d].p"):format(k + 1) end
    list[#list + 1] = connect(table.unpack(node))
    low[#low + 1] = ("C[%d].n"):format(k)
  end
  list[#list + 1] = connect(table.unpack(low))
  list[#list + 1] = connect("V.p", "R[1].p")
  return model { V = e.source{ v = 1 }, R = R, L = L, C = C, gnd = e.ground{}, list }
end

local function rod(n)
  local c, g, list = {}, { h.conductor{ G = n } }, { connect("hot.port", "g[1].a") }
  for k = 1, n do
    c[k], g[k + 1] = h.capacity{ C = 1/n, T0 = 300 }, h.conductor{ G = n }
    list[#list + 1] = connect(("g[%d].b"):format(k), ("c[%d].port"):format(k), ("g[%d].a"):format(k + 1))
  end
  list[#list + 1] = connect(("g[%d].b"):format(n + 1), "cold.port")
  return model { hot = h.temperature{ T = 400 }, cold = h.temperature{ T = 300 }, c = c, g = g, list }
end

test("ladders and rods become the equations of their states", function()
  for _, n in ipairs { 1, 7, 40 } do
    expect(#ladder(n):dae().equations):equals(2*n)
    expect(ladder(n):dae().kind):equals "ODE"
    expect(#rod(n):dae().equations):equals(n)
    expect(tostring(rod(n):dae().equations[1]):find("g[2].G", 1, true) ~= nil or n == 1):is_true()
  end
end)

test("what is left is what one would write: differences first, no product that cancels", function()
  local function rc(n)
    local R, C, list, low = {}, {}, {}, { "V.n", "gnd.p" }
    for k = 1, n do
      R[k], C[k] = e.resistor{}, e.capacitor{ v0 = 0 }
      list[#list + 1] = connect(("R[%d].n"):format(k), ("C[%d].p"):format(k))
      if k < n then list[#list + 1] = connect(("C[%d].p"):format(k), ("R[%d].p"):format(k + 1)) end
      low[#low + 1] = ("C[%d].n"):format(k)
    end
    list[#list + 1], list[#list + 2] = connect(table.unpack(low)), connect("V.p", "R[1].p")
    return model { V = e.source{ v = sin(t) }, R = R, C = C, gnd = e.ground{}, list }
  end
  for _, n in ipairs { 3, 12, 40 } do                -- the node of the ground has n + 2 currents
    local equations = rc(n):dae().equations
    expect(#equations):equals(n)
    expect(tostring(equations[2])):equals
      "C[2].C C[2].v′ = (C[1].v - C[2].v)/R[2].R - (C[2].v - C[3].v)/R[3].R"
    expect(equations[1].rhs:code():find("R[1].R\", 1)*(", 1, true)):equals(nil)
  end
  local l = components.translational
  local car = model { body = l.mass{ s0 = 1, v0 = 0 }, wheel = l.mass{ s0 = 0, v0 = 0 },
    strut = l.spring_damper{},
    bump = l.stop{}, tyre = l.spring{}, road = l.fixed{},
      connect("wheel.flange", "strut.a", "bump.a", "tyre.b"),
    connect("body.flange", "strut.b", "bump.b"), connect("road.flange", "tyre.a") }
  expect(car:dae().kind):equals "ODE"                -- the force of the stop, in two sums, is no unknown
  expect(tostring(car:dae().differential)):equals "(body.s, wheel.s, body.s′, wheel.s′)"
end)

test("positions stay, distances go: shafts behind gears, capacitors in a loop, frames at rest", function()
  local r, p = components.rotational, components.planar
  local function shafts(part)
    return model { G = r.inertia{ J = 0.1, phi0 = 0, w0 = 10 }, g = r.gear{ ratio = 3 }, c = part,
      L = r.inertia{ J = 2, phi0 = 0, w0 = 0 }, connect("G.flange", "g.a"), connect("g.b", "c.a"),
      connect("c.b", "L.flange") }:dae()
  end
  for _, part in ipairs { r.spring{ c = 50 }, r.spring_damper{ c = 50, d = 0.2 }, r.damper{ d = 0.2 } } do
    expect(shafts(part).kind):equals "ODE"
    expect(tostring(shafts(part).differential):find "G.phi, L.phi" ~= nil):is_true()
  end
  local C = e.capacitor
  local ring = model { V = e.source{ v = sin(t) }, R1 = e.resistor{}, R2 = e.resistor{}, gnd = e.ground{},
    C1 = C{ v0 = 0 }, C2 = C{}, C3 = C{ v0 = 0 }, connect("V.p", "R1.p"), connect("R1.n", "C1.p", "C2.p"),
    connect("C2.n", "C3.p", "R2.p"), connect("V.n", "C1.n", "C3.n", "R2.n", "gnd.p") }
  expect(#ring:dae().equations):equals(2)              -- the current through C2 is no unknown
  local engine = model { A = p.fixed{ phi = 0.3 }, j = p.prismatic{ nx = 0.6, ny = 0.8, s0 = 0, v0 = 1 },
    B = p.body{}, connect("A.frame", "j.a"), connect("j.b", "B.frame") }
  expect(#engine:dae().equations):equals(1)
  local sol = engine:integrate{ to = 1, rtol = 1e-9 }
  local slope = math.sin(0.3)*0.6 + math.cos(0.3)*0.8
  expect(sol(engine.j.s, 1)):near(1 - 9.81*slope/2, 1e-8)
end)

test("an input that only what is eliminated depends on is still an input", function()
  local u = input "u"
  local x, y = vars "x y"
  local low = dae { der(x) ~ -x, y ~ 3*u }:eliminate()
  expect(tostring(low.inputs)):equals "(u)"
  expect(low:integrate{ start = { x = 1 }, to = 1, inputs = { u = t } }(y, 1)):near(3, 1e-12)
  expect(function() low:integrate{ start = { x = 1 }, to = 1 }(y, 1) end):fails "'u' has no value"
end)

test("four times as many parts take four times as long, about", function()
  local function seconds(make, n)
    collectgarbage()
    local before = os.clock()
    make(n):dae()
    return os.clock() - before
  end
  for _, make in ipairs { ladder, rod } do
    make(10):dae()
    local few, many = seconds(make, 150), seconds(make, 600)
    expect(many/few < 8):is_true()
  end
end)

test("a parameter that is 0 or 1 is a number in the equations, until another run gives it another value", function()
  local p, r = components.planar, components.rotational
  local arm = model { w = p.fixed{}, j = p.revolute{ phi0 = 0, w0 = 0 }, R = p.rod{ dx = 1, dy = 0 },
    B = p.body{ m = 1, J = 0 }, c = r.spring{ c = 0 }, h = r.fixed{}, connect("w.frame", "j.a"),
    connect("j.b", "R.a"), connect("R.b", "B.frame"), connect("h.flange", "c.a"), connect("c.b", "j.axis") }
  local low = arm:dae()
  local function angle(params)
    return low:integrate{ to = 0.5, params = params, rtol = 1e-10 }(arm.j.phi, 0.5)
  end
  local first = angle()
  for _, params in ipairs { { ["R.dy"] = 1 }, { ["c.c"] = 2 }, { ["B.m"] = 3 }, { ["B.g"] = 0 } } do
    local now = angle(params)
    local alone = arm:with(params)
    expect(now):near(alone:integrate{ to = 0.5, rtol = 1e-10 }(arm.j.phi, 0.5), 1e-9)
    expect(angle()):equals(first)
  end
end)

test("behind a gear a spring has one difference of angles, in both equations", function()
  local r = components.rotational
  local train = model { A = r.inertia{ phi0 = 0, w0 = 1 }, g = r.gear{ ratio = 3 }, c = r.spring{ c = 50 },
    B = r.inertia{ phi0 = 0, w0 = 0 }, connect("A.flange", "g.a"), connect("g.b", "c.a"),
    connect("c.b", "B.flange") }
  for k = 1, 2 do
    expect(tostring(train:dae().equations[k]):find("(A.phi/g.ratio - B.phi)", 1, true) ~= nil):is_true()
  end
end)
