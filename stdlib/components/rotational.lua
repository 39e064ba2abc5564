-- Shafts: flanges with an angle phi and a torque tau on the part.
local component, connector = named "component", named "connector"
local check = use "components/check"
local m = use "components/library" ("rotational", "shafts; tau is the torque on the part")
local translational, electrical = use "components/translational", use "components/electrical"

m.flange = connector("rotational flange", { across = { phi = "rad" }, through = { tau = "N*m" },
  held_by = "a fixed point or an inertia" })

local euler = "Euler, Theoria motus corporum, 1765"

-- Flanges a and b, the angle phi from a to b and the torque tau that turns them together where it is
-- positive.
local function two_flanges(self)
  self.a, self.b = m.flange, m.flange
  local phi = self:var("phi", { unit = "rad", text = "relative angle" })
  local tau = self:var("tau", { unit = "N*m", text = "torque" })
  return phi, tau, { phi ~ self.b.phi - self.a.phi, self.b.tau ~ tau, self.a.tau ~ -tau }
end

local function with(list, ...)
  for _, equation in ipairs { ... } do list[#list + 1] = equation end
  return list
end

m.fixed = component("fixed", { phi0 = { 0, unit = "rad", text = "angle" } }, function(self)
  self.flange = m.flange
  return { self.flange.phi ~ self.phi0 }
end, { text = "A housing that does not turn.", source = "definition",
  example = [[
    x = model { w = e.fixed{ phi0 = 1 }, c = e.spring{ c = 3 }, A = e.angle{ phi = 3 },
                connect("w.flange", "c.a"), connect("c.b", "A.flange") }
    return x:init{}(x.c.tau)]], gives = "6.0" })

m.inertia = component("inertia", { J = { 1, unit = "kg*m^2", text = "moment of inertia" },
  phi0 = { false, unit = "rad", text = "angle at the start" },
  w0 = { false, unit = "rad/s", text = "speed at the start" } }, function(self)
  self.flange = m.flange
  local phi, w = self:var("phi", { unit = "rad", text = "angle" }),
    self:var("w", { unit = "rad/s", text = "speed" })
  self:start(phi, self.phi0)
  self:start(w, self.w0)
  self.energy = self.J*w^2/2
  return { phi ~ self.flange.phi, w ~ der(phi), self.J*der(phi, 2) ~ self.flange.tau }
end, { text = "J phi″ = tau; several parts can turn its flange.", source = euler,
  example = [[
    x = model { J = e.inertia{ J = 2, phi0 = 0, w0 = 3 }, T = e.torque{ tau = 4 },
                connect("J.flange", "T.flange") }
    return x:integrate{ to = 1 }(x.J.w, 1)]], gives = "5.0" })

m.spring = component("spring", { c = { 1, unit = "N*m/rad", text = "stiffness" },
  phi0 = { 0, unit = "rad", text = "angle without torque" } }, function(self)
  local phi, tau, list = two_flanges(self)
  self.energy = self.c*(phi - self.phi0)^2/2
  return with(list, tau ~ self.c*(phi - self.phi0))
end, { text = "tau = c (phi - phi0).", source = "Coulomb's torsion balance, 1784",
  example = [[
    x = model { c = e.spring{ c = 4 }, J = e.inertia{ J = 1, phi0 = 1, w0 = 0 }, w = e.fixed{},
                connect("w.flange", "c.a"), connect("c.b", "J.flange") }
    return x:integrate{ to = math.pi/2 }(x.J.phi, math.pi/2)]], gives = "-1.0" })

m.damper = component("damper", { d = { 1, unit = "N*m*s/rad", text = "viscosity" } }, function(self)
  local phi, tau, list = two_flanges(self)
  return with(list, tau ~ self.d*der(phi))
end, { text = "tau = d phi′.", source = "linear viscous friction",
  example = [[
    x = model { d = e.damper{ d = 2 }, J = e.inertia{ J = 2, phi0 = 0, w0 = 1 }, w = e.fixed{},
                connect("w.flange", "d.a"), connect("d.b", "J.flange") }
    return x:integrate{ to = 1 }(x.J.w, 1)]], gives = "0.3678794412" })

m.spring_damper = component("spring_damper", { c = { 1, unit = "N*m/rad" }, d = { 1, unit = "N*m*s/rad" },
  phi0 = { 0, unit = "rad", text = "angle without torque" } }, function(self)
  local phi, tau, list = two_flanges(self)
  return with(list, tau ~ self.c*(phi - self.phi0) + self.d*der(phi))
end, { text = "A spring and a damper side by side.", source = "Kelvin and Voigt",
  example = [[
    x = model { c = e.spring_damper{ c = 1, d = 2 }, J = e.inertia{ J = 1, phi0 = 1, w0 = 0 }, w = e.fixed{},
                connect("w.flange", "c.a"), connect("c.b", "J.flange") }
    return x:integrate{ to = 1 }(x.J.phi, 1)]], gives = "0.7357588824" })

m.stop = component("stop", { c = { 1e4, unit = "N*m/rad", text = "stiffness in contact" },
  d = { 1, unit = "N*m*s/rad", text = "viscosity in contact" },
  phi0 = { 0, unit = "rad", text = "angle of the contact" } }, function(self)
  local phi, tau, list = two_flanges(self)
  return with(list, tau ~ ifelse(lt(phi, self.phi0), min(0, self.c*(phi - self.phi0) + self.d*der(phi)), 0))
end, { text = "An elastic contact: pushes where the angle is less than phi0, never pulls.",
  source = "Kelvin and Voigt, without adhesion",
  example = [[
    x = model { w = e.fixed{}, S = e.stop{ c = 100, d = 0 }, J = e.inertia{ J = 1, phi0 = 1, w0 = -1 },
                connect("w.flange", "S.a"), connect("S.b", "J.flange") }
    return x:integrate{ to = 3, rtol = 1e-9 }(x.J.phi, 3) + math.pi/10]], gives = "2.0" })

m.torque = component("torque", { tau = { 0, unit = "N*m", text = "torque, a number or an expression in t" } },
  function(self)
    self.flange = m.flange
    return { self.flange.tau ~ -self.tau }
  end, { text = "A torque that is given.", source = "definition",
  example = [[
    x = model { T = e.torque{ tau = 6*t }, J = e.inertia{ J = 2, phi0 = 0, w0 = 0 }, connect("T.flange",
      "J.flange") }
    return x:integrate{ to = 2 }(x.J.phi, 2)]], gives = "4.0" })

m.signal_torque = component("signal_torque", {}, function(self)
  self.flange = m.flange
  local tau = self:input("tau", { unit = "N*m" })
  return { self.flange.tau ~ -tau }
end, { text = "A torque that a signal gives.", source = "definition",
  example = [[
    x = model { T = e.signal_torque{}, J = e.inertia{ J = 2, phi0 = 0, w0 = 0 }, connect("T.tau", 6*t),
                connect("T.flange", "J.flange") }
    return x:integrate{ to = 2 }(x.J.w, 2)]], gives = "6.0" })

m.angle = component("angle", { phi = { 0, unit = "rad", text = "angle, a number or an expression in t" } },
  function(self)
    self.flange = m.flange
    return { self.flange.phi ~ self.phi }
  end, { text = "A rotation that is given; the torque follows.", source = "definition",
  example = [[
    x = model { A = e.angle{ phi = t^2 }, J = e.inertia{ J = 3 }, connect("A.flange", "J.flange") }
    return x:dae():init{}(x.J.flange.tau)]], gives = "6.0" })

m.speed = component("speed", { w = { 0, unit = "rad/s", text = "speed, a number or an expression in t" },
  phi0 = { 0, unit = "rad", text = "angle at the start" } }, function(self)
    self.flange = m.flange
    local phi = self:var("phi", { unit = "rad" })
    self:start(phi, self.phi0)
    return { phi ~ self.flange.phi, der(phi) ~ self.w }
  end, { text = "A speed that is given; the torque follows.", source = "definition",
  example = [[
    x = model { S = e.speed{ w = 2, phi0 = 1 }, d = e.damper{ d = 4 }, w = e.fixed{}, connect("w.flange",
      "d.a"),
                connect("d.b", "S.flange") }
    sol = x:integrate{ to = 3 }
    return sol(x.S.phi, 3) + sol(x.d.tau, 3)]], gives = "15.0" })

m.sensor = component("sensor", {}, function(self)
  self.flange = m.flange
  local phi = self:output("phi", { unit = "rad" })
  return { phi ~ self.flange.phi, self.flange.tau ~ 0 }
end, { text = "The angle as a signal.", source = "definition",
  example = [[
    x = model { A = e.angle{ phi = t^2 }, s = e.sensor{}, connect("A.flange", "s.flange") }
    return x:init{ from = 3 }(x.s.phi)]], gives = "9.0" })

m.speed_sensor = component("speed_sensor", {}, function(self)
  self.flange = m.flange
  local w = self:output("w", { unit = "rad/s" })
  return { w ~ der(self.flange.phi), self.flange.tau ~ 0 }
end, { text = "The speed as a signal.", source = "definition",
  example = [[
    x = model { J = e.inertia{ phi0 = 0, w0 = 1 }, T = e.torque{ tau = 2 }, s = e.speed_sensor{},
                connect("J.flange", "T.flange", "s.flange") }
    return x:integrate{ to = 3 }(x.s.w, 3)]], gives = "7.0" })

-- ── transmissions ──────────────────────────────────────────────────────────────────────────────────────────

m.gear = component("gear", { ratio = { 1, text = "angle of a over angle of b" } }, function(self)
  check.not_zero(self, "ratio")
  self.a, self.b = m.flange, m.flange
  return { self.a.phi ~ self.ratio*self.b.phi, 0 ~ self.ratio*self.a.tau + self.b.tau }
end, { text = "Ideal: phi_a = ratio phi_b; the housing is fixed.", source = euler,
  example = [[
    x = model { T = e.torque{ tau = 1 }, A = e.inertia{ J = 1, phi0 = 0, w0 = 0 }, g = e.gear{ ratio = 2 },
                B = e.inertia{ J = 4 }, connect("T.flange", "A.flange", "g.a"), connect("g.b", "B.flange") }
    return x:integrate{ to = 2 }(x.A.w, 2)]], gives = "1.0" })

m.planetary = component("planetary", { ratio = { 2, text = "teeth of the ring over teeth of the sun" } },
  function(self)
    check.positive(self, "ratio")
    self.sun, self.carrier, self.ring = m.flange, m.flange, m.flange
    return { (1 + self.ratio)*self.carrier.phi ~ self.sun.phi + self.ratio*self.ring.phi,
      self.ring.tau ~ self.ratio*self.sun.tau, self.carrier.tau ~ -(1 + self.ratio)*self.sun.tau }
  end, { text = "Sun, carrier and ring of an ideal planetary gear.",
    source = "Willis, Principles of Mechanism, 1841",
    example = [[
      x = model { T = e.torque{ tau = 1 }, J = e.inertia{ J = 9, phi0 = 0, w0 = 0 },
                  g = e.planetary{ ratio = 2 }, w = e.fixed{}, connect("T.flange", "g.sun"),
                  connect("g.carrier", "J.flange"), connect("g.ring", "w.flange") }
      return x:integrate{ to = 3 }(x.J.w, 3)]], gives = "1.0" })

m.rack = component("rack", { r = { 1, unit = "m", text = "radius" } }, function(self)
  self.flange, self.slide = m.flange, translational.flange
  return { self.slide.s ~ self.r*self.flange.phi, 0 ~ self.flange.tau + self.r*self.slide.f }
end, { text = "A pinion and a rack, or a wheel that rolls: s = r phi.", source = "definition",
  example = [[
    l = components.translational
    x = model { T = e.torque{ tau = 2 }, r = e.rack{ r = 0.5 }, m = l.mass{ m = 2, s0 = 0, v0 = 0 },
                connect("T.flange", "r.flange"), connect("r.slide", "m.flange") }
    return x:integrate{ to = 1 }(x.m.v, 1)]], gives = "2.0" })

m.dc_motor = component("dc_motor", { R = { 1, unit = "Ohm" }, L = { 1e-3, unit = "H" },
  k = { 0.1, unit = "N*m/A", text = "torque per current, voltage per speed" },
  i0 = { 0, unit = "A", text = "current at the start" } }, function(self)
  self.p, self.n, self.flange = electrical.pin, electrical.pin, m.flange
  local i, w = self:var("i", { unit = "A", text = "current" }), self:var("w", { unit = "rad/s" })
  self:start(i, self.i0)
  return { i ~ self.p.i, 0 ~ self.p.i + self.n.i, w ~ der(self.flange.phi), self.flange.tau ~ -self.k*i,
    self.p.v - self.n.v ~ self.R*i + self.L*der(i) + self.k*w }
end, { text = "Armature with resistance and inductance; the field is constant.",
  source = "Leonhard, Control of Electrical Drives, §5",
  example = [[
    el = components.electrical
    x = model { V = el.source{ v = 5 }, M = e.dc_motor{}, J = e.inertia{ J = 1e-4, phi0 = 0, w0 = 0 },
                gnd = el.ground{}, connect("V.p", "M.p"), connect("V.n", "M.n", "gnd.p"),
                connect("M.flange", "J.flange") }
    return x:integrate{ to = 1 }(x.J.w, 1)]], gives = "50.0" })

-- ── three-phase machines ───────────────────────────────────────────────────────────────────────────────────

-- Pins a, b, c of a winding in star whose centre is free, the currents of its space phasor α, β and the
-- voltages.
local function star_winding(self)
  self.a, self.b, self.c, self.flange = electrical.pin, electrical.pin, electrical.pin, m.flange
  local i_alpha = self:var("i_alpha", { unit = "A", text = "current along the axis of phase a" })
  local i_beta = self:var("i_beta", { unit = "A", text = "current at right angles to it" })
  local a, b, c, root = self.a, self.b, self.c, sqrt(3)
  return i_alpha, i_beta, (2*a.v - b.v - c.v)/3, (b.v - c.v)/root, { a.i ~ i_alpha,
    b.i ~ (root*i_beta - i_alpha)/2, c.i ~ -(root*i_beta + i_alpha)/2 }
end

m.induction_motor = component("induction_motor", { Rs = { 1, unit = "Ohm", text = "stator resistance" },
  Rr = { 1, unit = "Ohm", text = "rotor resistance, seen from the stator" },
  Ls = { 0.1, unit = "H", text = "stator inductance" }, Lr = { 0.1, unit = "H", text = "rotor inductance" },
  Lm = { 0.095, unit = "H", text = "magnetising inductance" }, p = { 2, text = "pairs of poles" } },
    function(self)
  local is_a, is_b, v_a, v_b, list = star_winding(self)
  local ir_a, ir_b = self:var("ir_alpha", { unit = "A" }), self:var("ir_beta", { unit = "A" })
  local w = self:var("w", { unit = "rad/s", text = "speed" })
  for _, i in ipairs { is_a, is_b, ir_a, ir_b } do self:start(i, 0) end
  local psi_a, psi_b = self.Lr*ir_a + self.Lm*is_a, self.Lr*ir_b + self.Lm*is_b      -- flux of the rotor
  return { list, w ~ der(self.flange.phi),
    v_a ~ self.Rs*is_a + self.Ls*der(is_a) + self.Lm*der(ir_a),
    v_b ~ self.Rs*is_b + self.Ls*der(is_b) + self.Lm*der(ir_b),
    0 ~ self.Rr*ir_a + self.Lr*der(ir_a) + self.Lm*der(is_a) + self.p*w*psi_b,
    0 ~ self.Rr*ir_b + self.Lr*der(ir_b) + self.Lm*der(is_b) - self.p*w*psi_a,
    self.flange.tau ~ -3/2*self.p*self.Lm*(is_b*ir_a - is_a*ir_b) }
end, { text = "Squirrel cage, linear magnetics, in the coordinates of the stator; the star point is free.",
  source = "Leonhard, Control of Electrical Drives, §10; Kovács & Rácz, 1959",
  example = [[
    el, U, w = components.electrical, 100, 314
    x = model { A = el.source{ v = U*cos(w*t) }, B = el.source{ v = U*cos(w*t - 2*pi/3) },
                C = el.source{ v = U*cos(w*t + 2*pi/3) }, gnd = el.ground{}, M = e.induction_motor{},
                S = e.speed{ w = 150 }, connect("A.p", "M.a"), connect("B.p", "M.b"), connect("C.p", "M.c"),
                connect("A.n", "B.n", "C.n", "gnd.p"), connect("M.flange", "S.flange") }
    tau = x:integrate{ to = 0.5, rtol = 1e-8 }(x.S.flange.tau, 0.5)
    -- 3/2 p/w s (w Lm U)²/Rr / |…|² of the equivalent circuit with slip s
    s, Xs, Xr, Xm = 1 - 300/314, 31.4, 31.4, 29.83
    re, im = 1*1/s - (Xs*Xr - Xm^2), Xs*1/s + Xr*1
    torque = 3/2*2/314*(Xm*U)^2/s/(re^2 + im^2)
    return tau/torque]], gives = "1.0" })

m.synchronous_motor = component("synchronous_motor", { R = { 1, unit = "Ohm" },
  Ld = { 1e-2, unit = "H", text = "inductance along the magnets" },
  Lq = { 1e-2, unit = "H", text = "inductance at right angles" },
  psi = { 0.1, unit = "V*s", text = "flux of the magnets" }, p = { 2, text = "pairs of poles" } },
    function(self)
  local i_a, i_b, v_a, v_b, list = star_winding(self)
  local i_d, i_q = self:var("i_d", { unit = "A" }), self:var("i_q", { unit = "A" })
  local w = self:var("w", { unit = "rad/s", text = "speed" })
  self:start(i_d, 0)
  self:start(i_q, 0)
  local angle = self.p*self.flange.phi
  return { list, w ~ der(self.flange.phi), i_a ~ cos(angle)*i_d - sin(angle)*i_q,
    i_b ~ sin(angle)*i_d + cos(angle)*i_q,
    cos(angle)*v_a + sin(angle)*v_b ~ self.R*i_d + self.Ld*der(i_d) - self.p*w*self.Lq*i_q,
    cos(angle)*v_b - sin(angle)*v_a ~ self.R*i_q + self.Lq*der(i_q) + self.p*w*(self.Ld*i_d + self.psi),
    self.flange.tau ~ -3/2*self.p*(self.psi + (self.Ld - self.Lq)*i_d)*i_q }
end, { text = "Permanent magnets on the rotor, in its coordinates d, q; the magnets point along phase a "
  .. "where phi = 0.",
  source = "Park, AIEE Trans. 48, 1929; Leonhard, Control of Electrical Drives, §14",
  example = [[
    el = components.electrical
    x = model { A = el.source{ v = -20*sin(100*t) }, B = el.source{ v = -20*sin(100*t - 2*pi/3) },
                C = el.source{ v = -20*sin(100*t + 2*pi/3) }, gnd = el.ground{}, M = e.synchronous_motor{},
                S = e.speed{ w = 50 }, connect("A.p", "M.a"), connect("B.p", "M.b"), connect("C.p", "M.c"),
                connect("A.n", "B.n", "C.n", "gnd.p"), connect("M.flange", "S.flange") }
    sol = x:integrate{ to = 0.5, rtol = 1e-8 }
    -- v_d = 0 = i_d - i_q, v_q = 20 = i_q + i_d + 10: i_d = i_q = 5
    return sol(x.M.i_d, 0.5) + sol(x.S.flange.tau, 0.5)]], gives = "6.5" })

-- ── friction ───────────────────────────────────────────────────────────────────────────────────────────────

m.friction = component("friction", { tau0 = { 1, unit = "N*m", text = "torque when it slides" },
  taus = { false, unit = "N*m", text = "largest torque at rest; tau0 if not given" },
  rest = { 1e-6, unit = "rad/s", text = "slower than this counts as at rest" },
  mode0 = { 0, text = "at the start: 0 sticks, 1 and -1 slide; speeds decide where they differ" } },
  function(self)
  local phi, tau, list = two_flanges(self)
  local w = self:var("w", { unit = "rad/s", text = "sliding speed" })
  local static = self.given.taus and self.taus or self.tau0
  return with(list, w ~ der(phi), use "components/friction" (self, w, tau, self.tau0, static))
end, { text = "Dry friction between two shafts, or of a bearing, with stick.",
  source = "Coulomb, Théorie des machines simples, 1785",
  example = [[
    x = model { J = e.inertia{ J = 1, phi0 = 0, w0 = 4 }, R = e.friction{ tau0 = 2, mode0 = 1 },
                w = e.fixed{},
                connect("w.flange", "R.a"), connect("R.b", "J.flange") }
    return x:integrate{ to = 5 }(x.J.phi, 5)]], gives = "4.0" })

m.clutch = component("clutch", { tau0 = { 1, unit = "N*m", text = "torque it carries where u = 1, sliding" },
  peak = { 1, text = "torque at rest over torque sliding, 1 or more" },
  rest = { 1e-6, unit = "rad/s", text = "slower than this counts as at rest" },
  mode0 = { 0, text = "at the start: 0 sticks, 1 and -1 slide; speeds decide where they differ" } },
  function(self)
  local phi, tau, list = two_flanges(self)
  local u = self:input("u", { text = "pressure: 0 open … 1" })
  local w = self:var("w", { unit = "rad/s", text = "sliding speed" })
  local capacity = self.tau0*u
  return with(list, w ~ der(phi), use "components/friction" (self, w, tau, capacity, self.peak*capacity))
end, { text = "A friction clutch, or a brake if one side is fixed, whose pressure is a signal.",
  source = "Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, §8",
  example = [[
    x = model { A = e.inertia{ J = 1, phi0 = 0, w0 = 10 }, B = e.inertia{ J = 1, phi0 = 0, w0 = 0 },
                K = e.clutch{ tau0 = 5, mode0 = -1 }, connect("A.flange", "K.a"), connect("K.b", "B.flange"),
                connect("K.u", 1) }
    return x:integrate{ to = 2 }(x.B.w, 2)]], gives = "5.0" })

return m
