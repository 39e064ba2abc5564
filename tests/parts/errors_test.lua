-- What is wrong with a model of parts is said by path, with a remedy.
local e, l, s = components.electrical, components.translational, components.signals
local h, w = components.thermal, components.hydraulic

local function fails(items, ...)
  for _, words in ipairs { ... } do
    expect(function()
      local m = model(items)
      m:index()
      m:integrate{ to = 1 }
    end):fails(words)
  end
end

test("sources that contradict each other are named with their connections", function()
  fails({ V = e.source{ v = 1 }, W = e.source{ v = 2 }, g = e.ground{}, connect("V.p", "W.p"),
    connect("V.n", "W.n", "g.p") }, "of V, W, g, connect(V.p, W.p)",
      "remove one, or put another part between them")
  fails({ a = l.position{ s = t }, b = l.position{ s = 2*t }, m = l.mass{},
    connect("a.flange", "b.flange", "m.flange") }, "of a, b, connect(a.flange, b.flange)")
  fails({ a = w.pump{ q = 1 }, b = w.pump{ q = 2 }, A = w.ambient{}, B = w.ambient{}, connect("A.port",
    "a.a"),
    connect("a.b", "b.a"), connect("b.b", "B.port") }, "of a, b, sum at a.b")
  fails({ V = e.source{ v = 1 }, R = e.resistor{}, g = e.ground{}, h = e.ground{}, connect("V.p", "R.p"),
    connect("V.n", "R.n", "g.p", "h.p") }, "of g, h, connect(V.n, g.p), connect(V.n, h.p)")
end)

test("a run of what is fixed twice says so, too", function()
  local m = model { V = e.source{ v = 1 }, W = e.source{ v = 1 }, R = e.resistor{}, g = e.ground{},
    connect("V.p", "W.p", "R.p"), connect("V.n", "W.n", "R.n", "g.p") }
  expect(function() m:integrate{ to = 1 } end):fails "V, W, g, connect(V.p, W.p), connect(V.n, W.n)"
  expect(function() m:integrate{ to = 1 } end):fails "fix the same quantity twice: remove one"
end)

test("a connector or variable that is not there: where the path ends, and what there is", function()
  local R, V, g = e.resistor{ R = 2 }, e.source{ v = 1 }, e.ground{}
  local function circuit(...) return { R = R, V = V, g = g, connect("V.n", "R.n", "g.p"), ... } end
  fails(circuit(connect("V.p", "R.x")), "connect: R has no connector 'x'. It has n, p.")
  fails(circuit(connect("V.p", "R.P")), "connect: R has no connector 'P'. It has n, p.")
  fails(circuit(connect("V.p", "S.p")),
    "connect: this model has no part, connector or variable 'S'. It has R, V, g.")
  fails(circuit(connect("V.p", "R")), "connect: 'R' is a whole part; name one of its connectors: n, p")
  fails(circuit(connect("V.p", "R.p"), var "R.ii" ~ 3),
    "R has no part, connector or variable 'ii'. Did you mean 'i'?")
  local started = circuit(connect("V.p", "R.p"))
  started.start = { ["R.u"] = 0 }
  fails(started, "start: R has no part, connector or variable 'u'")
  fails({ cell = { s.gain{}, s.gain{} }, connect(1, "cell[1].u"), connect("cell[1].y", "cell[2].x") },
    "cell[2] has no connector 'x'. It has u, y.")
  expect(function() return R.m end)
    :fails "resistor has no part, connector or variable 'm'. It has R, i, n, p, v."
  fails(circuit(connect("V.p", "R.p"), var "R.i" ~ 3),
    "this model: equations of its own: R.i = 3; unknowns of its own: none")
end)

test("parameters are numbers or expressions, said where they are given", function()
  local function refused(make, words) expect(make):fails(words) end
  refused(function() return e.resistor{ R = "big" } end,
    "resistor: R [Ohm] must be a number or an expression, not the text 'big'")
  refused(function() return e.resistor{ R = true } end, "not a boolean")
  refused(function() return e.resistor{}{ R = 0/0 } end, "not nan")
  refused(function() return e.inductor{ L = 1/0 } end,
    "inductor: L [H] must be a number or an expression, not infinity")
  refused(function() return e.source{ v = function(time) return time end } end,
    "source: v [V] must be a number or an expression, not a function: of the time, write it with t")
  refused(function() return e.capacitor{ v0 = "zero" } end, "capacitor: v0 [V]")
  refused(function() return l.mass{ m = e.ground{} } end,
    "mass: m [kg] must be a number or an expression, not a part")
  fails({ R = e.resistor{ R = { 1, 2 } }, connect "R.p", connect "R.n" }, "in R (component resistor)")
  local m = model { R = e.resistor{ R = "1/3" }, V = e.source{ v = 1 }, g = e.ground{}, connect("V.p", "R.p"),
    connect("V.n", "R.n", "g.p") }
  expect(m:init{}(m.R.i)):equals(3)                    -- text that is a number is exact, and a parameter
  expect(m:init{ params = { ["R.R"] = 2 } }(m.R.i)):equals(0.5)
end)

test("errors inside a component name the part", function()
  local bad = component("bad", {}, function(self)
    self.p = e.pin
    return { self.q.v ~ 0 }
  end)
  for _, words in ipairs { "x has no part, connector or variable 'q'. It has p.", "in x (component bad)" } do
    expect(function() return model { x = bad{}, connect "x.p" } end):fails(words)
  end
end)

test("signals and connectors", function()
  fails({ R = e.resistor{}, G = s.gain{}, connect("R.p", "G.u") },
    "R.p (electrical pin) is a connector and G.u a signal",
    "a sensor makes a signal of a connector")
  fails({ J = components.rotational.inertia{}, m = l.mass{}, connect("J.flange", "m.flange") },
    "a part that has a connector of each kind goes between them")
end)

test("a part and a symbol of one name", function()
  local F = input "F"
  fails({ m = l.mass{ s0 = 0, v0 = 0 }, F = l.signal_force{}, connect("F.flange", "m.flange"),
    connect("F.f", F) },
    "'F' is a part of this model and a symbol in its equations; give one of them another name")
  fails({ m = l.mass{ s0 = 0, v0 = 0 }, F = { l.force{ f = 1 } }, connect("F[1].flange", "m.flange"),
    var "F" ~ 1 },
    "'F' is a list of parts of this model")
  fails({ p = h.port, T = h.temperature{}, connect("p", "T.port"), var "p" ~ 1 },
    "'p' is a connector of this model")
end)

test("what is inside a part is not connected from outside", function()
  local inner = model { T = h.temperature{}, G = h.conductor{}, connect("T.port", "G.a"), connect "G.b" }
  fails({ a = inner, b = h.temperature{ T = 3 }, connect("a.T.port", "b.port") },
    "a.T.port (heat port) is inside a; give a a connector of its own")
  local mine = model { p = h.port, T = h.temperature{ T = 5 }, G = h.conductor{ G = 2 }, connect("T.port",
    "G.a"),
    connect("p", "G.b") }
  local m = model { a = mine, b = h.temperature{ T = 3 }, connect("a.p", "b.port") }
  expect(m:init{}(m.a.G.Q)):near(4, 1e-12)
end)

test("a function may return one connection", function()
  local sub = component("sub", {}, function(self)
    self.R, self.p = e.resistor{}, e.pin
    return connect(self.p, self.R.p)
  end)
  fails({ sub = sub{}, g = e.ground{}, connect("sub.p", "g.p") },
    "sub.R.n (electrical pin) is connected to nothing")
end)

test("a signal with two sources, connections or equations", function()
  fails({ a = s.gain{}, connect(1, "a.u"), connect(2, "a.u") }, "a.u is driven twice")
  fails({ a = s.gain{}, connect(1, "a.u"), var "a.u" ~ 2 }, "a.u, which connect(1, a.u) drives")
end)

test("units", function()
  local k1 = connector("pin", { across = { v = "V" }, through = { i = "A" } })
  local k2 = connector("pin", { across = { v = "mV" }, through = { i = "A" } })
  local a = component("a", {}, function(self)
    self.p = k1
    return self.p.v ~ 1
  end)
  local b = component("b", {}, function(self)
    self.p = k2
    return self.p.v ~ 1
  end)
  fails({ a = a{}, b = b{}, connect("a.p", "b.p") },
    "a.p (pin) and b.p (pin) cannot be joined: v [V] against v [mV]")
  local odd = component("odd", { k = { 1, unit = "N*s/m" } }, function(self)
    self.a = l.flange
    return self.a.f ~ self.k*self.a.s
  end)
  fails({ units = "check", m = l.mass{ s0 = 0, v0 = 0 }, c = odd{}, connect("m.flange", "c.a") },
    "c.a.f [N] against c.k c.a.s [m*kg/s]")
end)

test("definitions that contain themselves", function()
  local A, B
  A = component("A", {}, function(self) self.b = B{} end)
  B = component("B", {}, function(self) self.a = A{} end)
  fails({ x = A{} }, "x.b.a.b.a", "Does the component A contain itself?")
  local deep
  deep = component("deep", { n = 0 }, function(self)
    if self.given.n > 0 then self.a = deep{ n = self.given.n - 1 } end
  end)
  fails({ x = deep{ n = 10000 } }, "Does the component deep contain itself?")
  deep = component("deep", { n = 0 }, function(self)     -- with other parts before the one that goes down
    self.R = e.resistor{}
    if self.given.n > 0 then self.a = deep{ n = self.given.n - 1 } end
  end)
  fails({ x = deep{ n = 10000 } }, "Does the component deep contain itself?")
  local list = {}
  list[1] = list
  fails(list, "does a list contain itself?")
end)

test("starts", function()
  local function circuit(C)
    return { V = e.source{ v = 1 }, C = C, g = e.ground{}, connect("V.p", "C.p"), connect("V.n", "C.n",
      "g.p") }
  end
  fails(circuit(e.capacitor{ v0 = 3 }), "the equations give C.v = V.v = 1")
  fails({ V = e.source{ v = 1 }, R = e.resistor{}, C = e.capacitor{}, g = e.ground{}, connect("V.p", "R.p"),
    connect("R.n", "C.p"), connect("V.n", "C.n", "g.p") }, "nothing gives a value to C.v")
end)

test("starts of parts that contradict: the part that says so, and the call that leaves it open", function()
  local g = e.ground{}
  fails({ V = e.source{ v = 5 }, C = e.capacitor{ v0 = 1 }, g = g, connect("V.p", "C.p"),
    connect("V.n", "C.n", "g.p") }, "C{ v0 = false } leaves it to the other equations")
  fails({ a = l.mass{ s0 = 0, v0 = 0 }, b = l.mass{ s0 = 1, v0 = 0 }, connect("a.flange", "b.flange") },
    "a{ s0 = false } or b{ s0 = false }")
  local r = components.rotational
  fails({ I = e.current{ i = 3 }, M = r.dc_motor{}, J = r.inertia{ phi0 = 0, w0 = 0 }, g = g,
    connect("I.n", "M.p"), connect("I.p", "M.n", "g.p"), connect("M.flange", "J.flange") }, "M{ i0 = false }")
end)

test("parameters that no part can mean", function()
  local r = components.rotational
  fails({ R = s.relay{ low = 1, high = -1 }, connect("R.u", t) }, "low = 1 must be less than high = -1",
    "in R (component relay)")
  fails({ S = s.sampler{ Ts = 0 }, connect("S.u", t) }, "Ts = 0 must be greater than 0")
  fails({ P = s.pulse{ width = 2 } }, "width = 2 must be between 0 and 1")
  fails({ T = r.torque{}, g = r.gear{ ratio = 0 }, J = r.inertia{}, connect("T.flange", "g.a"),
    connect("g.b", "J.flange") }, "ratio = 0: nothing is transmitted")
end)

test("remedies name paths as they are typed", function()
  local c = components.process
  fails({ X = c.heat_exchanger{}, connect("X.w1", 1) }, 'connect(source.y, "X.w2")')
end)

test("a start at which a spring has no length names the spring", function()
  local p = components.planar
  local m = model { w = p.fixed{}, c = p.spring{ k = 4, s0 = 1 }, connect("w.frame", "c.a"),
    B = p.body{ x0 = 0, y0 = 0, phi0 = 0, vx0 = 0, vy0 = 0, w0 = 0 }, connect("c.b", "B.frame") }
  expect(function() m:integrate{ to = 1 } end):fails "c.s is 0 there"
end)

test("what nothing fixes, in every domain: which parts, and what holds it", function()
  local r, p = components.rotational, components.planar
  local pump, pipe = w.pump{ q = 1e-3 }, w.pipe{}
  fails({ P = pump, R = pipe, connect("P.b", "R.a"), connect("R.b", "P.a") },
    "nothing fixes p (hydraulic port) of P, R", "to an ambient, a tank or an accumulator")
  fails({ P = w.centrifugal_pump{}, R = pipe, connect("P.b", "R.a"), connect("R.b", "P.a") },
    "nothing fixes p (hydraulic port) of R, P")
  fails({ Q = h.heat_flow{ Q = 3 }, G = h.conductor{}, connect("Q.port", "G.a"), connect "G.b" },
    "nothing fixes T (heat port) of Q, G", "to a temperature or a capacity")
  fails({ F = l.force{ f = 3 }, c = l.spring{}, H = l.force{ f = -3 }, connect("F.flange", "c.a"),
    connect("H.flange", "c.b") }, "nothing fixes s (translational flange) of F, c, H")
  fails({ F = r.torque{ tau = 3 }, d = r.damper{}, H = r.torque{ tau = -3 }, connect("F.flange", "d.a"),
    connect("H.flange", "d.b") }, "nothing fixes phi (rotational flange) of F, d, H")
  fails({ F = p.force{ fx = 1 }, c = p.spring{}, H = p.force{ fx = -1 }, connect("F.frame", "c.a"),
    connect("H.frame", "c.b") }, "nothing fixes phi (planar frame) of F, c, H")
  local held = model { T = w.tank{ h0 = 1 }, P = pump, R = pipe, connect("P.b", "R.a", "T.port"),
    connect("R.b", "P.a") }
  expect(held:dof()):equals(1)                         -- a tank holds the pressure of a loop
end)

test("a capacitor without capacitance: what to write", function()
  local m = model { V = e.source{ v = sin(t) }, R = e.resistor{}, C = e.capacitor{ C = 0, v0 = 0 },
    g = e.ground{}, connect("V.p", "R.p"), connect("R.n", "C.p"), connect("V.n", "C.n", "g.p") }
  expect(function() m:integrate{ to = 1 } end):fails 'C.C is 0 and was divided by; params = { ["C.C"] = 0 }'
  expect(m:integrate{ to = 1, params = { ["C.C"] = 0 } }(m.R.i, 1)):equals(0)
end)

test("an event that is no table names the part", function()
  local odd = component("odd", {}, function(self) self:event(3) end)
  fails({ x = odd{} }, "x: an event is a table", "in x (component odd)")
end)
