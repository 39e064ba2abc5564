-- Components, connections and models of parts: names, copies, nesting, arrays, errors by path.
local e, l, r = components.electrical, components.translational, components.rotational

local function circuit()
  local R, C, V = e.resistor{ R = 100 }, e.capacitor{ C = 1e-4, v0 = 0 }, e.source{ v = 5*sin(50*t) }
  return model { R = R, C = C, V = V, gnd = e.ground{},
                 connect(V.p, R.p), connect(R.n, C.p), connect(C.n, V.n, "gnd.p") }
end

test("names are paths, in sol, fix, params and tolerances", function()
  local rc = circuit()
  expect(tostring(rc.C.v)):equals "C.v"
  local sol = rc:integrate{ to = 0.1, rtol = 1e-9, atol = 1e-12 }
  expect(sol(rc.R.v, 0.1)):near(sol(rc.R.R*rc.R.i, 0.1), 1e-12)
  expect(sol(rc.gnd.p.i, 0.1)):near(0, 1e-12)
  expect(sol("R.v", 0.1)):near(sol(rc.R.v, 0.1), 1e-12)
  expect(rc:init{ fix = { [rc.R.i] = 0.01 }, guess = { [rc.C.v] = 0 } }(rc.C.v)):near(-1, 1e-9)
  expect(rc:init{ fix = { ["C.v"] = 2 } }(rc.R.i)):near(-0.02, 1e-12)
  local other = rc:integrate{ to = 0.1, params = { ["R.R"] = 50 } }
  expect(other(rc.R.v, 0.1)):near(other(50*rc.R.i, 0.1), 1e-12)
  expect(rc:with{ [rc.R.R] = 50 }:integrate{ to = 0.1 }(rc.C.v, 0.1)):near(other(rc.C.v, 0.1), 1e-12)
end)

test("index and dof are those of all equations; what is integrated has fewer", function()
  local rc = circuit()
  expect(rc:index()):equals(1)
  expect(rc:dof()):equals(1)
  expect(#rc:flat().equations):equals(19)
  expect(#rc:dae().equations):equals(1)
  expect(rc:dae():dof()):equals(1)
  expect(rc:structure().dof):equals(1)
  expect(sweep(rc, { to = 0.1, params = { ["R.R"] = { 50, 100 } } }):final(rc.C.v)[1]):near(
    rc:integrate{ to = 0.1, params = { ["R.R"] = 50 } }(rc.C.v, 0.1), 1e-5)
end)

test("the same part twice is two copies", function()
  local cart = l.mass{ m = 1, s0 = 0, v0 = 0 }
  local two = model { a = cart, b = cart{ m = 2, s0 = 1 }, c = l.spring{ k = 10 },
                      connect("a.flange", "c.a"), connect("c.b", "b.flange") }
  expect(two:dof()):equals(4)
  local sol = two:integrate{ to = 1, rtol = 1e-9 }
  expect(sol(two.a.m*two.a.v + two.b.m*two.b.v, 1)):near(0, 1e-8)       -- momentum
  expect(function() return model { a = cart, b = cart, connect(cart.flange, "b.flange") }:dof() end):fails
    "2 times (a, b)"
  local pair = model { x = two, y = two }
  expect(pair:dof()):equals(8)
  expect(tostring(pair.y.b.v)):equals "y.b.v"
  expect(function() return model { x = two, y = two, two.a.s ~ 0 } end):fails "2 times (x, y)"
end)

test("models nest in equations and without a name", function()
  local F, x = vars "F x"
  local plant = dae { der(x, 2) ~ F }
  local loop = dae { plant, F ~ -4*x, start = { [x] = 1, [x.dot] = 0 } }
  expect(loop:integrate{ to = math.pi/2, rtol = 1e-9 }(x, math.pi/2)):near(-1, 1e-7)
  local m = model { p = plant, plant_force = l.mass{ s0 = 0, v0 = 0 }, F ~ -4*x,
    connect("plant_force.flange") }
  expect(tostring(m.p.x)):equals "p.x"
  expect(m:dof()):equals(4)
  local u = input "u"
  local driven = dae { der(x) ~ u - x }
  local outer = model { a = driven, b = driven, connect("a.u", 1), connect("b.u", "a.x") }
  expect(outer:dof()):equals(2)
  local sol = outer:integrate{ start = { ["a.x"] = 0, ["b.x"] = 0 }, to = 1, rtol = 1e-9 }
  expect(sol(outer.b.x, 1)):near(1 - 2*math.exp(-1), 1e-8)
end)

test("lists of parts, and parts inside components", function()
  local cells = {}
  for k = 1, 4 do cells[k] = e.resistor{ R = k } end
  local m = model { V = e.source{ v = 10 }, gnd = e.ground{}, cell = cells, connect("V.p", "cell[1].p"),
    connect("cell[1].n", "cell[2].p"), connect("cell[2].n", "cell[3].p"), connect("cell[3].n", "cell[4].p"),
    connect("cell[4].n", "V.n", "gnd.p") }
  expect(m:init{}(m.cell[4].i)):near(1, 1e-12)
  expect(tostring(m.cell[3].i)):equals "cell[3].i"
end)

test("systems, other than parts, are parts", function()
  local m = model { G = tf({ 1 }, { 1, 1 }), H = ss({{-2}}, {{1}}, {{1}}, {{0}}), connect("G.u", 1),
    connect("G.y", "H.u") }
  local y = m:integrate{ to = 1, rtol = 1e-10 }(m.H.y, 1)
  expect(y):near(0.5 - math.exp(-1) + 0.5*math.exp(-2), 1e-8)
  local d = model { G = c2d(tf({ 1 }, { 1, 1 }), 0.25), z = components.signals.integrator{},
    connect("G.u", 1), connect("G.y", "z.u") }
  local held = 0
  for k = 0, 3 do held = held + 0.25*(1 - math.exp(-0.25*k)) end
  expect(d:integrate{ to = 1 }(d.z.y, 1)):near(held, 1e-6)
  local q = var "q"
  local bob = lagrange{ q = { q }, T = q.dot^2/2, V = 2*q^2 }:ports{ tip = { l.flange, s = q } }
  local p = model { P = bob, m = l.mass{ m = 3, s0 = 1, v0 = 0 }, connect("P.tip", "m.flange") }
  expect(p:dof()):equals(2)
  expect(p:integrate{ to = math.pi/math.sqrt(1), rtol = 1e-9 }(p.P.q, math.pi)):near(-1, 1e-6)
end)

-- ── errors ─────────────────────────────────────────────────────────────────────────────────────────────────

local function fails(items, text)
  expect(function() return model(items):index() end):fails(text)
end

test("unconnected, unlike, floating, doubly driven", function()
  local R, C = e.resistor{}, e.capacitor{}
  fails({ R = R, C = C, g = e.ground{}, connect(R.p, C.p, "g.p") }, 'connect("R.n") alone to leave it open')
  fails({ R = R, m = l.mass{}, connect(R.p, "m.flange") },
    "R.p (electrical pin) and m.flange (translational flange) cannot be joined: v [V] against s [m]")
  fails({ R = R, C = C, connect(R.p, C.p), connect(R.n, C.n) }, "the circuit of R floats")
  fails({ V = e.source{ v = 1 }, W = e.source{ v = 2 }, g = e.ground{}, connect("V.p", "W.p"),
    connect("V.n", "W.n", "g.p") }, "")
  local s = components.signals
  fails({ a = s.gain{}, b = s.gain{}, c = s.gain{}, connect("a.y", "c.u"), connect("b.y", "c.u") },
    "driven twice")
  fails({ a = s.gain{}, b = s.gain{}, connect("a.y", "b.y") }, "both outputs")
  fails({ a = s.gain{} }, "the input a.u has no source")
  expect(function() return connect(R, C) end):fails "a whole part: name one of its connectors"
  expect(function() return R:index() end):fails "is open"
end)

test("two sources in parallel contradict each other, two grounds repeat each other", function()
  local m = model { V = e.source{ v = 1 }, W = e.source{ v = 2 }, g = e.ground{}, connect("V.p", "W.p"),
    connect("V.n", "W.n", "g.p") }
  expect(function() return m:dae() end):fails "W.v"
  local g = model { V = e.source{ v = 1 }, R = e.resistor{}, g = e.ground{}, h = e.ground{},
    connect("V.p", "R.p"),
    connect("V.n", "R.n", "g.p", "h.p") }
  expect(function() return g:dae() end):fails "follows from the others"
end)

test("wrong names, wrong counts, cycles", function()
  expect(function() return e.resistr{} end):fails "Did you mean 'resistor'"
  expect(function() return e.resistor{ r = 1 } end):fails "resistor has no parameter 'r'"
  expect(function() return circuit().R.w end):fails "R has no part, connector or variable 'w'"
  expect(function() return circuit().Q end):fails "this model has no part"
  expect(function() return model { index = e.resistor{} } end):fails "'index' cannot be the name"
  expect(function() return model { e.resistor } end):fails "component"
  expect(function() return model { R = e.resistor } end):fails "write resistor{}"
  expect(function() return model { R = nil, nil, e.ground{} } end):fails "entry 1"
  local short = component("short", {}, function(self)
    self.p, self.n = e.pin, e.pin
    return { self.p.v ~ self.n.v }
  end)
  expect(function() return model { s = short{} } end):fails "s (component short) has 1 equation, but needs 2"
  local loop
  loop = component("loop", {}, function(self) self.inner = loop{} end)
  expect(function() return model { a = loop{} } end):fails "Does the component loop contain itself"
  local deep = model { R = e.resistor{} }
  expect(function()
    for _ = 1, 10000 do deep = model { deeper = deep } end
  end):fails "levels deep"
  fails({ G = e.ground{}, R = e.resistor{}, connect("G.p", "R.p", "R.n"), var "z" ~ 1, var "z" ~ 2 },
    "1 too many")
end)

test("a tree, a diagram, a picture's source", function()
  local rc = circuit()
  expect(tostring(rc:tree()):find("├ R    resistor{ R = 100 }", 1, true) ~= nil):is_true()
  expect(rc:diagram():find("(1)  V.p ── R.p", 1, true) ~= nil):is_true()
  local file = os.tmpname() .. ".dot"
  rc:diagram(file)
  local handle = io.open(file)
  local text = handle:read "a"
  handle:close()
  os.remove(file)
  expect(text:find('"V" -- "R"', 1, true) ~= nil):is_true()
end)

test("two models of parts that are saved come back", function()
  local rc = circuit()
  local name = os.tmpname() .. ".lua"
  save(name, rc:dae())
  local again = load(name)
  os.remove(name)
  expect(again:integrate{ to = 0.1 }("C.v", 0.1)):near(rc:integrate{ to = 0.1 }(rc.C.v, 0.1), 1e-12)
end)

test("a factor that is a number at the values of the parameters, and points at which everything is held",
  function()
  local h = components.thermal
  local m = model { V = e.source{ v = 10 }, R = h.heating_resistor{ R = 5, alpha = 0 },
    C = h.capacity{ C = 2, T0 = 300 },
    gnd = e.ground{}, connect("V.p", "R.p"), connect("V.n", "R.n", "gnd.p"), connect("R.port", "C.port") }
  expect(m:integrate{ to = 1 }(m.C.T, 1)):near(310, 1e-6)
  local train = model { A = r.inertia{ J = 1, phi0 = 0, w0 = 10 }, B = r.inertia{ J = 1, phi0 = 0, w0 = 0 },
    K = r.clutch{ tau0 = 5, mode0 = -1 }, connect("K.u", ifelse(lt(t, 0.5), 0, 1)),
      connect("A.flange", "K.a"),
    connect("K.b", "B.flange") }
  expect(train:integrate{ to = 3 }(train.B.w, 3)):near(5, 1e-5)
end)

test("connections of signals: t and expressions drive several inputs, outputs pass through", function()
  local s = components.signals
  local m = model { a = s.integrator{}, b = s.integrator{ k = 2 }, connect("a.u", t), connect("b.u", t) }
  expect(m:integrate{ to = 2 }(m.a.y + m.b.y, 2)):near(6, 1e-6)
  local twice = component("twice", {}, function(self)
    self.first, self.second = s.gain{ k = 2 }, s.gain{ k = 3 }
    local u, y = self:input "u", self:output "y"
    return { connect(u, self.first.u), connect(self.first.y, self.second.u), connect(self.second.y, y) }
  end)
  local chain = model { x = twice{}, z = s.integrator{}, connect("x.u", 1), connect("x.y", "z.u") }
  expect(chain:integrate{ to = 1 }(chain.z.y, 1)):near(6, 1e-6)
end)

test("curves of parts have their paths; diagrams show signals and what is inside parts", function()
  local rc = circuit()
  expect(rc.C.v.label):equals "C.v [V]"
  local s, h = components.signals, components.thermal
  local loop = model { P = s.first_order{ T = 2 }, K = s.gain{ k = -3 }, connect("P.y", "K.u"),
    connect("K.y", "P.u") }
  local outer = model { inner = loop, circuit = rc }
  local text = outer:diagram()
  expect(text:find("inner.P.y → inner.K.u", 1, true) ~= nil):is_true()
  expect(text:find("circuit.V.p ── circuit.R.p", 1, true) ~= nil):is_true()
  local file = os.tmpname() .. ".dot"
  outer:diagram(file)
  local handle = io.open(file)
  local source = handle:read "a"
  handle:close()
  os.remove(file)
  expect(source:find('"circuit.R" [label="R\\nresistor"]', 1, true) ~= nil):is_true()
  expect(source:find('subgraph "cluster inner"', 1, true) ~= nil):is_true()
  expect(source:find('"inner.P" -- "inner.K" [dir=forward', 1, true) ~= nil):is_true()
end)

test("an identified model is a part with its own sample time", function()
  local y, u = { 0 }, {}
  for k = 1, 60 do
    u[k] = (k*k) % 7 - 3
    y[k + 1] = 0.5*y[k] + u[k]
  end
  y[61] = nil
  local found = arx(iddata{ y = y, u = u, Ts = 0.25 }, { na = 1, nb = 1, nk = 1 })
  local m = model { G = found, z = components.signals.gain{}, connect("G.u", 1), connect("G.y", "z.u") }
  local sol = m:integrate{ to = 2 }
  for k = 1, 7 do expect(sol(m.z.y, 0.25*k + 0.1)):near(2*(1 - 0.5^k), 1e-9) end
end)

test("a guess is no other value of a start", function()
  local h = components.thermal
  local m = model { C = h.capacity{ C = 1, T0 = 300 }, G = h.conductor{}, B = h.temperature{ T = 400 },
    connect("C.port", "G.a"), connect("G.b", "B.port") }
  expect(m:init{ guess = { ["C.T"] = 0 } }(m.C.T)):equals(300)
  expect(m:init{ fix = { ["C.T"] = 5 } }(m.C.T)):equals(5)
end)

test("speeds and accelerations that no equation needs can be asked for", function()
  local p = components.planar
  local m = model { w = p.fixed{}, j = p.revolute{ phi0 = 0.3, w0 = 2 }, crank = p.rod{ dx = 1 },
    pin = p.revolute{}, rod = p.rod{ dx = 2 }, bolt = p.revolute{}, piston = p.body{ g = 0 },
    slide = p.prismatic{},
    disc = p.body{ g = 0 }, connect("w.frame", "j.a", "slide.a"), connect("j.b", "crank.a", "disc.frame"),
    connect("crank.b", "pin.a"), connect("pin.b", "rod.a"), connect("rod.b", "bolt.a"),
    connect("bolt.b", "slide.b", "piston.frame") }
  local low = m:reduce()
  local sol = low:integrate{ start = low:init{ guess = { ["pin.phi"] = -0.5, ["slide.s"] = 2.9 } }, to = 0.5,
    rtol = 1e-10, atol = 1e-10 }
  local h = 1e-3                                           -- central differences: h² w‴/6
  for _, pair in ipairs { { m.pin.phi, m.pin.w }, { m.pin.w, der(m.pin.w) }, { m.bolt.w, der(m.bolt.w) } } do
    local slope = (sol(pair[1], 0.25 + h) - sol(pair[1], 0.25 - h))/(2*h)
    expect(sol(pair[2], 0.25)):near(slope, 1e-4)
  end
  local x, z = vars "x z"
  local run = dae { der(x) ~ z - x, 0 ~ z^3 + z - sin(x) }:integrate{ start = { x = 1 }, to = 1,
    rtol = 1e-10 }
  expect(run(der(z), 1)):near(run(cos(x)*(z - x)/(3*z^2 + 1), 1), 1e-9)
end)

test("what takes a model takes a model of parts", function()
  local e, l = components.electrical, components.translational
  local function rc(source)
    return model { V = source, R = e.resistor{ R = 2 }, C = e.capacitor{ C = 0.5, v0 = 1 }, g = e.ground{},
      connect("V.p", "R.p"), connect("R.n", "C.p"), connect("V.n", "C.n", "g.p") }
  end
  local m = rc(e.source{ v = 3 })
  expect(tostring(equilibria(m)):find("C.v = V.v", 1, true) ~= nil):is_true()
  expect(json(m):find('"differential": ["C.v"]', 1, true) ~= nil):is_true()
  expect(latex(m)):equals(m:latex())
  expect(tostring(explain_step(m, rk.euler)):find "One step of" ~= nil):is_true()
  local errors = converge(m, { start = { ["C.v"] = 0 }, to = 1, methods = { "rk4" }, dt = { 0.1, 0.05 },
    reference = "self" })
  expect(tostring(errors):find "rk4" ~= nil):is_true()
  local file = os.tmpname() .. ".lua"
  save(file, m)
  expect(load(file):integrate{ to = 1 }("C.v", 1)):near(m:integrate{ to = 1 }(m.C.v, 1), 1e-12)
  os.remove(file)
  local swing = model { m = l.mass{}, c = l.spring{}, w = l.fixed{}, connect("w.flange", "c.a"),
    connect("c.b", "m.flange") }
  local square = { xlim = { -1, 1 }, ylim = { -1, 1 } }
  expect(phase(swing, swing.m.s, swing.m.s.dot, square).labels[1] ~= nil):is_true()
  expect(function() phase(swing, swing.m.s, swing.m.v, square) end):fails "its states: m.s, m.s′"
  local u = input "u"
  local open = rc(e.signal_source{})
  local driven = model { P = open, connect("P.V.v", u) }
  local F = estimator(driven, mat { { 1 } }, { y = driven.P.C.v })
  expect(#F.equations):equals(1)
  local names = {}
  for name in pairs(m) do names[#names + 1] = name end
  expect(table.concat(names, " ")):equals "V R C g"
end)

test("an expression with a name, of parts by value or by path, in copies, and a variable", function()
  local e, l = components.electrical, components.translational
  local R, V = e.resistor{ R = 2 }, e.source{ v = 3 }
  local m = model { R = R, V = V, g = e.ground{}, power = R.v*R.i, P = var "P", var "P" ~ 2*var "R.i",
    U = var "R.v", connect("V.p", "R.p"), connect("V.n", "R.n", "g.p") }
  local at = m:init{}
  expect(tostring(m.power)):equals "R.v R.i"
  expect(at(m.power)):near(4.5, 1e-12)
  expect(at(m.P)):near(3, 1e-12)
  expect(at(m.U)):near(3, 1e-12)
  local two = model { a = m, b = m }
  expect(tostring(two.b.power)):equals "b.R.v b.R.i"
  expect(two:init{}(two.a.power + two.b.P)):near(7.5, 1e-12)
  local moving = model { l.mass{ m = 2, s0 = 0, v0 = 3 }, T = var "mass.m"*var "mass.v"^2/2,
    connect "mass.flange" }
  expect(moving:integrate{ to = 1 }(moving.T, 1)):near(9, 1e-9)
end)
