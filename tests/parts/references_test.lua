-- Models as their users write them, integrated by default, against equations written by hand and integrated
-- by
-- scipy (references.py prints the numbers), and against closed solutions.
local e, l, r, h = components.electrical, components.translational, components.rotational,
  components.hydraulic
local p, s, c = components.planar, components.signals, components.process

-- sol at `to` is what was computed by hand, relative to the size of each number.
local function reaches(m, to, wanted, within, options)
  local o = { to = to, rtol = 1e-9, atol = 1e-11 }
  for key, value in pairs(options or {}) do o[key] = value end
  local sol = m:integrate(o)
  expect(sol.status):equals "finished"
  for _, pair in ipairs(wanted) do
    expect((sol(pair[1], to) - pair[2])/math.max(math.abs(pair[2]), 1e-2)):near(0, within)
  end
  return sol
end

-- A voltage, level or opening that changes at given times: values[1] until times[1], …
local function steps(times, values)
  local e = values[#values]
  for k = #times, 1, -1 do e = ifelse(lt(t, times[k]), values[k], e) end
  return e
end

test("Chua's circuit (Chua, Desoer & Kuh, Linear and Nonlinear Circuits, 1987) at 200 s", function()
  local chua_diode = component("chua_diode", { Ga = -0.757576, Gb = -0.409091, Ve = 1 }, function(self)
    self.p, self.n = e.pin, e.pin
    local v = self.p.v - self.n.v
    return { self.p.i ~ self.Gb*v + (self.Ga - self.Gb)/2*(abs(v + self.Ve) - abs(v - self.Ve)),
      0 ~ self.p.i + self.n.i }
  end)
  local m = model { L = e.inductor{ L = 18, i0 = 0 }, Ro = e.resistor{ R = 0.0125 },
    G = e.conductor{ G = 0.565 },
    C1 = e.capacitor{ C = 10, v0 = 4 }, C2 = e.capacitor{ C = 100, v0 = 0 }, N = chua_diode{},
      gnd = e.ground{},
    connect("L.n", "Ro.p"), connect("L.p", "C2.p", "G.p"), connect("G.n", "C1.p", "N.p"),
    connect("Ro.n", "C1.n", "C2.n", "N.n", "gnd.p") }
  reaches(m, 200, { { m.C1.v, 1.85296469898 }, { m.C2.v, -0.814187920822 }, { m.L.i, 2.37066648483 } }, 1e-6)
end)

test("Furuta pendulum with its motor (Furuta, Yamakita & Kobayashi, 1992) at 1 s", function()
  local th, al = vars "th al"
  local m, len, R, J, g = 0.1, 0.2, 0.15, 1e-3, 9.81
  local arm = lagrange { q = { th, al },
    T = J*th.dot^2/2 + m/2*((R*th.dot - len*cos(al)*al.dot)^2 + len^2*sin(al)^2*(th.dot^2 + al.dot^2)),
    V = m*g*len*cos(al) }:ports { shaft = { r.flange, phi = th } }
  local x = model { P = arm, M = r.dc_motor{ R = 2, L = 1e-3, k = 0.05 }, V = e.source{ v = 1 },
    gnd = e.ground{},
    connect("M.flange", "P.shaft"), connect("V.p", "M.p"), connect("V.n", "M.n", "gnd.p") }
  reaches(x, 1, { { x.P.th, 1.50844034952 }, { x.P.al, 3.83606998872 }, { x.M.i, 0.215544748084 } }, 1e-6,
    { start = { ["P.th"] = 0, ["P.al"] = 0.1, ["P.th'"] = 0, ["P.al'"] = 0, ["M.i"] = 0 } })
end)

test("three tanks (DTS 200) at 200 s", function()
  local m = model { pump = h.pump{ q = 3e-5 }, air = h.ambient{}, drain = h.ambient{},
    T1 = h.tank{ A = 0.0154, h0 = 0.4 }, T2 = h.tank{ A = 0.0154, h0 = 0.2 },
      T3 = h.tank{ A = 0.0154, h0 = 0.3 },
    v13 = h.orifice{ A = 5e-5, Cd = 0.5 }, v32 = h.orifice{ A = 5e-5, Cd = 0.5 },
      v20 = h.orifice{ A = 5e-5, Cd = 0.6 },
    connect("air.port", "pump.a"), connect("pump.b", "T1.port", "v13.a"),
      connect("v13.b", "T3.port", "v32.a"),
    connect("v32.b", "T2.port", "v20.a"), connect("v20.b", "drain.port") }
  reaches(m, 200, { { m.T1.h, 0.332417712173 }, { m.T2.h, 0.101490847018 }, { m.T3.h, 0.230975905934 } },
    1e-7)
end)

test("rectifier bridge with ideal diodes at 0.1 s", function()
  local D = e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 }
  local m = model { V = e.source{ v = 10*sin(2*pi*50*t) }, R = e.resistor{ R = 100 },
    Ri = e.resistor{ R = 1 },
    C = e.capacitor{ C = 1e-3, v0 = 0 }, gnd = e.ground{}, D1 = D, D2 = D, D3 = D, D4 = D,
    connect("V.p", "Ri.p"), connect("Ri.n", "D1.p", "D2.n"), connect("V.n", "D3.p", "D4.n"),
    connect("D1.n", "D3.n", "C.p", "R.p"), connect("D2.p", "D4.p", "C.n", "R.n", "gnd.p") }
  reaches(m, 0.1, { { m.C.v, 9.25785733427 } }, 1e-6)
end)

-- 1 for the first part `duty` of every period T, then 0.
local function pwm(T, duty)
  return s.state_machine{ inputs = 0, y = { 1, 0 }, transitions = {
    { from = 1, to = 2, when = function(_, since) return since - duty*T end },
    { from = 2, to = 1, when = function(_, since) return since - (1 - duty)*T end } } }
end

test("buck converter with ideal switch and diode after 20 periods", function()
  local m = model { V = e.source{ v = 12 }, S = e.switch{ Ron = 1e-3, Goff = 1e-6 },
    D = e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 }, L = e.inductor{ L = 1e-3, i0 = 0 },
    C = e.capacitor{ C = 1e-4, v0 = 0 }, R = e.resistor{ R = 10 }, gnd = e.ground{}, clock = pwm(1e-4, 0.5),
    connect("clock.y", "S.on"), connect("V.p", "S.p"), connect("S.n", "D.n", "L.p"),
      connect("L.n", "C.p", "R.p"),
    connect("V.n", "D.p", "C.n", "R.n", "gnd.p") }
  reaches(m, 0.002, { { m.L.i, 0.211772009408 }, { m.C.v, 4.92667931757 } }, 1e-6)
end)

test("H-bridge, DC motor and PWM after 100 periods", function()
  local S, u = e.switch{ Ron = 0.01, Goff = 1e-9 }, "clock.y"
  local m = model { V = e.source{ v = 24 }, S1 = S, S2 = S, S3 = S, S4 = S, clock = pwm(1e-3, 0.7),
    M = r.dc_motor{ R = 1, L = 5e-3, k = 0.1 }, J = r.inertia{ J = 1e-3, phi0 = 0, w0 = 0 },
      d = r.damper{ d = 1e-3 },
    w = r.fixed{}, gnd = e.ground{}, connect(u, "S1.on"), connect(u, "S4.on"), connect(1 - var(u), "S2.on"),
    connect(1 - var(u), "S3.on"), connect("V.p", "S1.p", "S3.p"), connect("S1.n", "S2.p", "M.p"),
    connect("S3.n", "S4.p", "M.n"), connect("S2.n", "S4.n", "V.n", "gnd.p"),
      connect("M.flange", "J.flange", "d.a"),
    connect("d.b", "w.flange") }
  reaches(m, 0.1, { { m.M.i, 2.91044843551 }, { m.J.w, 57.6474308578 } }, 1e-5)
end)

test("hydraulic cylinder with a servo valve", function()
  local m = model { P = h.ambient{ p = 1e7 }, T = h.ambient{}, V = h.servo_valve{ K = 1e-8 },
    C = h.cylinder{ A = 2e-3, Ab = 1e-3 }, load = l.mass{ m = 100, s0 = 0, v0 = 0 }, d = l.damper{ d = 2000 },
    k = l.spring{ k = 1e4 }, w = l.fixed{}, connect("V.u", steps({ 0.1 }, { 0, 0.5 })),
      connect("P.port", "V.supply"),
    connect("T.port", "V.tank"), connect("V.a", "C.a"), connect("V.b", "C.b"),
      connect("C.rod", "load.flange", "d.b", "k.b"),
    connect("w.flange", "d.a", "k.a") }
  reaches(m, 0.5, { { m.load.s, 0.00306531222631 }, { m.load.v, 0.00757049508697 }, { m.C.pa, 657223.492893 },
    { m.C.pb, 1267307.37947 } }, 1e-5)
end)

test("quarter car: tyre that lifts off, bump stop", function()
  local mb, mw, ks, kt, g = 300, 40, 1.5e4, 1.6e5, 9.81
  local zw = -(mb + mw)*g/kt
  local m = model { body = l.mass{ m = mb, s0 = zw - mb*g/ks, v0 = 0 },
    wheel = l.mass{ m = mw, s0 = zw, v0 = 0 },
    G1 = l.force{ f = -mb*g }, G2 = l.force{ f = -mw*g }, strut = l.spring_damper{ k = ks, d = 1200 },
    bump = l.stop{ k = 2e5, d = 0, s0 = -0.25 }, tyre = l.stop{ k = kt, d = 0 }, road = l.position{ s = 0.1 },
    connect("wheel.flange", "strut.a", "bump.a", "tyre.b", "G2.flange"),
    connect("body.flange", "strut.b", "bump.b", "G1.flange"), connect("road.flange", "tyre.a") }
  reaches(m, 1, { { m.body.s, -0.132277717697 }, { m.body.v, 0.230318843411 }, { m.wheel.s, 0.0793081422509 },
    { m.wheel.v, 0.019915926116 } }, 1e-6)
end)

test("planetary gear with a clutch on its ring", function()
  local m = model { T = r.torque{ tau = 3 }, A = r.inertia{ J = 1, phi0 = 0, w0 = 0 },
    g = r.planetary{ ratio = 2 },
    B = r.inertia{ J = 3 }, C = r.inertia{ J = 2, phi0 = 0, w0 = 0 },
      brake = r.clutch{ tau0 = 10, mode0 = -1 },
    w = r.fixed{}, connect("brake.u", steps({ 1 }, { 0, 1 })), connect("T.flange", "A.flange", "g.sun"),
    connect("g.carrier", "B.flange"), connect("g.ring", "C.flange", "brake.b"),
      connect("w.flange", "brake.a") }
  -- until 1 s: a = 2.5, c = -0.5 (see scripts/components/planetary.lua); the brake slides with 10 N m:
  -- (4/3) a + (2/3) c = 3, (2/3) a + (10/3) c = 10, until the ring stands; then w_B = w_A/3, (1 + 3/9) a = 3
  local det = 40/9 - 4/9
  local a, cc = (3*10/3 - 10*2/3)/det, (10*4/3 - 3*2/3)/det
  local stops = 0.5/cc
  local sun = 2.5 + a*stops + 2.25*(2 - 1 - stops)
  reaches(m, 2, { { m.A.w, sun }, { m.B.w, sun/3 }, { m.C.w, 0 }, { m.brake.mode, 0 } }, 1e-6)
end)

test("crane: trolley, rope and load", function()
  local m = model { w = p.fixed{}, rail = p.prismatic{ s0 = 0, v0 = 0 },
    trolley = p.body{ m = 50, J = 1, g = 0 },
    hinge = p.revolute{ phi0 = 0, w0 = 0 }, rope = p.rod{ dx = 0, dy = -3 }, load = p.body{ m = 20, J = 0 },
    F = l.force{ f = steps({ 1, 2 }, { 30, -30, 0 }) }, connect("w.frame", "rail.a"),
    connect("rail.b", "trolley.frame", "hinge.a"), connect("hinge.b", "rope.a"),
      connect("rope.b", "load.frame"),
    connect("rail.axis", "F.flange") }
  reaches(m, 5, { { m.rail.s, 0.355915498465 }, { m.hinge.phi, 0.084867089889 },
    { m.rail.v, -0.189896515294 },
    { m.hinge.w, 0.222346169611 } }, 1e-6)
end)

test("inverted pendulum with a sampled linear-quadratic regulator", function()
  local M, mb, len, g, Ts = 1, 0.2, 0.5, 9.81, 0.02
  local x, th = vars "x th"
  local cart = lagrange { q = { x, th }, V = mb*g*len*cos(th),
    T = M*x.dot^2/2 + mb/2*((x.dot - len*cos(th)*th.dot)^2 + len^2*sin(th)^2*th.dot^2) }:ports {
      push = { l.flange, s = x } }
  local K = dlqr(c2d(ss({ { 0, 0, 1, 0 }, { 0, 0, 0, 1 }, { 0, mb*g/M, 0, 0 },
    { 0, (M + mb)*g/(M*len), 0, 0 } },
    { { 0 }, { 0 }, { 1/M }, { 1/(M*len) } }, eye(4), zeros(4, 1)), Ts), diag(vec{ 10, 10, 1, 1 }),
      mat{ { 1 } })
  local m = model { P = cart, F = l.signal_force{}, hold = s.sampler{ Ts = Ts },
    connect("F.flange", "P.push"),
    connect("hold.y", "F.f"),
    connect(-(K(1, 1)*var "P.x" + K(1, 2)*var "P.th" + K(1, 3)*der(var "P.x") + K(1, 4)*der(var "P.th")),
      "hold.u") }
  reaches(m, 2, { { m.P.x, -0.141835097102 }, { m.P.th, 0.0113006253318 }, { m.P.x.dot, 0.211876230789 },
    { m.P.th.dot, 0.0235507544913 } }, 1e-6, {
      start = { ["P.x"] = 0, ["P.th"] = 0.2, ["P.x'"] = 0, ["P.th'"] = 0 } })
end)

test("Atwood's machine over a pulley with bearing friction", function()
  -- m1 down, m2 up: (m1 + m2 + J/r²) a = (m1 - m2) g - tau/r
  local rope = { r.rack{ r = 0.2 }, r.rack{ r = -0.2 } }
  local m = model { A = rope[1], B = rope[2], J = r.inertia{ J = 0.08, phi0 = 0, w0 = 0 },
    f = r.friction{ tau0 = 0.6 },
    m1 = l.mass{ m = 3 }, m2 = l.mass{ m = 2 }, G1 = l.force{ f = 3*9.81 }, G2 = l.force{ f = 2*9.81 },
      w = r.fixed{},
    connect("J.flange", "A.flange", "B.flange", "f.b"), connect("w.flange", "f.a"),
    connect("A.slide", "m1.flange", "G1.flange"), connect("B.slide", "m2.flange", "G2.flange") }
  local a = (9.81 - 0.6/0.2)/(5 + 0.08/0.04)
  reaches(m, 2, { { m.m1.s, 2*a }, { m.m2.v, -2*a } }, 1e-7)
end)

test("three-phase bridge with an inductive load", function()
  local D, items, plus, minus, star = e.ideal_diode{ Ron = 1e-2, Goff = 1e-5 }, { gnd = e.ground{} }, {}, {},
    { "gnd.p" }
  for k = 1, 3 do
    items["V" .. k] = e.source{ v = 100*cos(2*pi*50*t - 2*pi*(k - 1)/3) }
    items["R" .. k], items["U" .. k], items["L" .. k] = e.resistor{ R = 0.1 }, D, D
    items[#items + 1] = connect(("V%d.p"):format(k), ("R%d.p"):format(k))
    items[#items + 1] = connect(("R%d.n"):format(k), ("U%d.p"):format(k), ("L%d.n"):format(k))
    plus[k], minus[k], star[k + 1] = ("U%d.n"):format(k), ("L%d.p"):format(k), ("V%d.n"):format(k)
  end
  items.R, items.L = e.resistor{ R = 10 }, e.inductor{ L = 0.05, i0 = 0 }
  plus[4], minus[4] = "R.p", "L.n"
  for _, list in ipairs { plus, minus, star, { "R.n", "L.p" } } do
    items[#items + 1] = connect(table.unpack(list))
  end
  local m = model(items)
  reaches(m, 0.01, { { m.L.i, 14.0780912541 } }, 1e-5, { rtol = 1e-8 })
end)

test("inrush of a transformer with remanence, and a resonant circuit that saturates", function()
  local m = model { V = e.source{ v = 325*sin(2*pi*50*t) }, R = e.resistor{ R = 1 },
    T = e.saturating_inductor{ L = 1, psi0 = 0.2 }, gnd = e.ground{}, connect("V.p", "R.p"),
      connect("R.n", "T.p"),
    connect("V.n", "T.n", "gnd.p") }
  reaches(m, 0.01, { { m.T.psi, 1.67283226358 }, { m.T.i, 104.254927284 } }, 1e-6)
  reaches(m, 0.2, { { m.T.psi, -0.891863953721 }, { m.T.i, -1.24887980867 } }, 1e-6)
  local q = model { V = e.source{ v = 5*cos(60*t) }, R = e.resistor{ R = 0.5 }, gnd = e.ground{},
    L = e.saturating_inductor{ L = 0.1, psis = 0.05 }, C = e.capacitor{ C = 1e-3, v0 = 0 },
      connect("V.p", "R.p"),
    connect("R.n", "L.p"), connect("L.n", "C.p"), connect("V.n", "C.n", "gnd.p") }
  reaches(q, 0.5, { { q.L.psi, 0.0393913145033 }, { q.C.v, 0.671429319376 } }, 1e-5)
end)

test("DC motor with a limited PI controller and a step of the load", function()
  local m = model { V = e.signal_source{}, M = r.dc_motor{ R = 1, L = 2e-3, k = 0.1 },
    J = r.inertia{ J = 1e-3, phi0 = 0, w0 = 0 },
    d = r.damper{ d = 1e-4 }, w = r.fixed{}, load = r.torque{ tau = steps({ 0.5 }, { 0, -0.5 }) },
      gnd = e.ground{},
    pi = s.pid{ k = 0.5, Ti = 0.1, low = -24, high = 24 }, connect("pi.r", 100), connect("pi.v", var "J.w"),
    connect("pi.y", "V.v"), connect("V.p", "M.p"), connect("V.n", "M.n", "gnd.p"),
    connect("M.flange", "J.flange", "d.b", "load.flange"), connect("w.flange", "d.a") }
  reaches(m, 1, { { m.M.i, 5.10824731885 }, { m.J.w, 99.9160740329 }, { m.pi.z, 15.057727998 } }, 1e-6)
end)

test("counterflow heat exchanger: effectiveness of Kays & London", function()
  local m = model { X = c.heat_exchanger{ UA = 1000, cells = 100, counter = true, T0 = 320 },
    connect("X.w1", 500),
    connect("X.w2", 800), connect("X.T1_in", 350), connect("X.T2_in", 290) }
  local sol = reaches(m, 1000, {}, 1, { rtol = 1e-6 })
  expect(sol(m.X.T1, 1000)):near(305.080428787, 0.2)     -- cells of finite size: an error of order 1/100
  expect(sol(m.X.T2, 1000)):near(318.074732008, 0.2)
end)

test("a state machine that fills and empties a tank", function()
  -- fills with 0.02 m³/s from 0.2 to 1 m, rests 10 s, empties with 0.04 m³/s
  local m = model { T = h.tank{ A = 1, h0 = 0.2 }, P = h.pump{ q = var "flow" }, air = h.ambient{},
    connect("air.port", "P.a"), connect("P.b", "T.port"),
    M = s.state_machine{ inputs = 1, states = 3, y = { 0.02, 0, -0.04 }, transitions = {
      { from = 1, to = 2, when = function(u) return u[1] - 1 end },
      { from = 2, to = 3, when = function(_, since) return since - 10 end },
      { from = 3, to = 1, when = function(u) return 0.2 - u[1] end } } },
    connect("M.u1", var "T.h"), var "flow" ~ var "M.y" }
  reaches(m, 55, { { m.T.h, 0.8 } }, 1e-6)                -- 40 s, 10 s, 5 s of 20 s
  reaches(m, 75, { { m.T.h, 0.3 } }, 1e-6)
end)

test("cells in cells in cells: 2 × 2 × 2 of them", function()
  local cell = component("cell", { R = 1, C = 0.1 }, function(self)
    self.a, self.b, self.low = e.pin, e.pin, e.pin
    self.R1, self.C1 = e.resistor{ R = self.R }, e.capacitor{ C = self.C, v0 = 0 }
    return { connect(self.a, self.R1.p), connect(self.R1.n, self.C1.p, self.b), connect(self.C1.n, self.low) }
  end)
  local function twice(name, inner)
    return component(name, {}, function(self)
      self.a, self.b, self.low = e.pin, e.pin, e.pin
      self.cell = { inner{}, inner{} }
      return { connect(self.a, self.cell[1].a), connect(self.cell[1].b, self.cell[2].a),
        connect(self.cell[2].b, self.b),
        connect(self.low, self.cell[1].low, self.cell[2].low) }
    end)
  end
  local bank = twice("bank", twice("module", twice("string", cell)))
  local m = model { V = e.source{ v = 1 }, B = bank{}, gnd = e.ground{}, connect("V.p", "B.a"),
    connect("B.b"),
    connect("V.n", "B.low", "gnd.p") }
  expect(m:dof()):equals(8)
  reaches(m, 2, { { m.B.cell[1].cell[1].cell[1].C1.v, 0.881393657023 },
    { m.B.cell[2].cell[2].cell[2].C1.v, 0.361218960708 } }, 1e-7)
end)

test("slider crank", function()
  local m = model { w = p.fixed{}, j = p.revolute{ phi0 = 0.3, w0 = 20 }, J = r.inertia{ J = 0.01 },
    crank = p.rod{ dx = 0.1 },
    pin = p.revolute{}, rod = p.rod{ dx = 0.3 }, bolt = p.revolute{},
      piston = p.body{ m = 0.5, J = 1, g = 0 },
    guide = p.prismatic{}, connect("j.axis", "J.flange"), connect("w.frame", "j.a", "guide.a"),
      connect("j.b", "crank.a"),
    connect("crank.b", "pin.a"), connect("pin.b", "rod.a"), connect("rod.b", "bolt.a"),
    connect("bolt.b", "piston.frame", "guide.b") }
  expect(m:dof()):equals(2)
  local low = m:reduce()
  local rod = -math.asin(0.1*math.sin(0.3)/0.3)
  local sol = low:integrate{ to = 0.5, rtol = 1e-10, atol = 1e-10,
    start = low:init{ guess = { ["pin.phi"] = rod - 0.3, ["bolt.phi"] = -rod, ["guide.s"] = 0.4 } } }
  expect(sol(m.j.phi, 0.5)):near(9.56615518334, 1e-6)
  expect(sol(m.j.w, 0.5)):near(20.7008707786, 1e-5)
end)

test("four-bar linkage, its crank driven by 0.5 N m", function()
  local m = model { w = p.fixed{}, far = p.fixed{ x = 0.35 }, T = r.torque{ tau = 0.5 },
    J1 = r.inertia{ J = 0.01 },
    J3 = r.inertia{ J = 0.03 }, j = p.revolute{ phi0 = 0.5, w0 = 0 }, crank = p.rod{ dx = 0.1 },
      pin = p.revolute{},
    at_pin = p.body{ m = 1, J = 0.02, g = 0 }, coupler = p.rod{ dx = 0.4 }, knee = p.revolute{},
      k = p.revolute{},
    rocker = p.rod{ dx = 0.3 }, connect("j.axis", "J1.flange", "T.flange"), connect("k.axis", "J3.flange"),
    connect("w.frame", "j.a"), connect("j.b", "crank.a"), connect("crank.b", "pin.a"),
    connect("pin.b", "at_pin.frame", "coupler.a"), connect("coupler.b", "knee.a"),
      connect("far.frame", "k.a"),
    connect("k.b", "rocker.a"), connect("rocker.b", "knee.b") }
  expect(m:dof()):equals(2)
  local low = m:reduce()
  local sol = low:integrate{ to = 1, rtol = 1e-10, atol = 1e-10,
    start = low:init{ guess = { ["pin.phi"] = 0.3, ["k.phi"] = 1.6, ["knee.phi"] = 0.8 } } }
  expect(sol(m.j.phi, 1)):near(11.5256143154, 1e-6)
  expect(sol(m.j.w, 1)):near(21.4723639229, 1e-5)
  expect(sol(m.at_pin.phi, 1)):near(1.11669171996, 1e-6)
  expect(sol(m.k.phi, 1)):near(1.99683509773, 1e-6)
end)

test("double wishbone, its spring and damper, at 0.2 s", function()
  local function link(x, y) return p.rod{ dx = x, dy = y } end
  local m = model { L = p.fixed{}, U = p.fixed{ x = 0.1, y = 0.3 }, jL = p.revolute{ phi0 = 0, w0 = 0 },
    lower = link(0.4, 0), jC = p.revolute{}, low = link(0, 0.15), carrier = p.body{ m = 20, J = 0.5 },
      up = link(0, 0.15),
    jD = p.revolute{}, jU = p.revolute{}, upper = link(0.3, 0), seat = p.fixed{ x = 0.1, y = 0.6 },
    strut = p.spring{ k = 2e4, d = 1500, s0 = 0.65 }, connect("L.frame", "jL.a"), connect("jL.b", "lower.a"),
    connect("lower.b", "jC.a"), connect("jC.b", "low.a"),
      connect("low.b", "carrier.frame", "up.a", "strut.b"),
    connect("seat.frame", "strut.a"), connect("up.b", "jD.b"), connect("U.frame", "jU.a"),
      connect("jU.b", "upper.a"),
    connect("upper.b", "jD.a") }
  local low = m:reduce()
  local sol = low:integrate{ to = 0.2, rtol = 1e-10, atol = 1e-10,
    start = low:init{ guess = { ["jC.phi"] = 0, ["jU.phi"] = 0, ["jD.phi"] = 0 } } }
  expect(sol(m.carrier.x, 0.2)):near(0.360421113468, 1e-7)
  expect(sol(m.carrier.y, 0.2)):near(-0.00953850226428, 1e-7)
  expect(sol(m.carrier.phi, 0.2)):near(0.0429882549026, 1e-7)
end)
