-- Circuits: pins with a potential v and a current i into the part.
local component, connector = named "component", named "connector"
local check = use "components/check"
local e = use "components/library" ("electrical", "circuits; i counts into the part")

e.pin = connector("electrical pin", { across = { v = "V" }, through = { i = "A" }, reference = true })

-- Pins p and n, the voltage v from p to n and the current i from p to n.
local function two_pins(self)
  self.p, self.n = e.pin, e.pin
  local v = self:var("v", { unit = "V", text = "voltage" })
  local i = self:var("i", { unit = "A", text = "current" })
  return v, i, { v ~ self.p.v - self.n.v, i ~ self.p.i, 0 ~ self.p.i + self.n.i }
end

local function with(list, ...)
  for _, equation in ipairs { ... } do list[#list + 1] = equation end
  return list
end

e.ground = component("ground", {}, function(self)
  self.p = e.pin
  self:reference(self.p)
  return { self.p.v ~ 0 }
end, { text = "The point with potential 0; every circuit has one.", source = "Kirchhoff's voltage law",
  example = [[
    m = model { I = e.current{ i = 3 }, R = e.resistor{ R = 2 }, gnd = e.ground{},
                connect("I.n", "R.p"), connect("I.p", "R.n", "gnd.p") }
    return m:init{}(m.I.n.v)]], gives = "6.0" })

-- ── two pins ───────────────────────────────────────────────────────────────────────────────────────────────

e.resistor = component("resistor", { R = { 1, unit = "Ohm", text = "resistance" } }, function(self)
  local v, i, list = two_pins(self)
  return with(list, v ~ self.R*i)
end, { text = "Ohm's law v = R i.", source = "Ohm, Die galvanische Kette, 1827",
  example = [[
    m = model { V = e.source{ v = 10 }, R = e.resistor{ R = 5 }, gnd = e.ground{},
                connect("V.p", "R.p"), connect("V.n", "R.n", "gnd.p") }
    return m:init{}(m.R.i)]], gives = "2.0" })

e.conductor = component("conductor", { G = { 1, unit = "S", text = "conductance" } }, function(self)
  local v, i, list = two_pins(self)
  return with(list, i ~ self.G*v)
end, { text = "i = G v; G = 0 is a break.", source = "Ohm, Die galvanische Kette, 1827",
  example = [[
    m = model { V = e.source{ v = 10 }, G = e.conductor{ G = 3 }, gnd = e.ground{},
                connect("V.p", "G.p"), connect("V.n", "G.n", "gnd.p") }
    return m:init{}(m.G.i)]], gives = "30.0" })

e.capacitor = component("capacitor", { C = { 1e-6, unit = "F", text = "capacitance" },
  v0 = { false, unit = "V", text = "voltage at the start" } }, function(self)
  local v, i, list = two_pins(self)
  self:start(v, self.v0)
  return with(list, i ~ self.C*der(v))
end, { text = "i = C v′. Voltage sources and capacitors in a loop have index 2.",
  source = "Faraday's law of charge",
  example = [[
    m = model { I = e.current{ i = 2 }, C = e.capacitor{ C = 4, v0 = 1 }, gnd = e.ground{},
                connect("I.p", "C.n", "gnd.p"), connect("I.n", "C.p") }
    return m:integrate{ to = 6 }(m.C.v, 6)]], gives = "4.0" })

e.inductor = component("inductor", { L = { 1e-3, unit = "H", text = "inductance" },
  i0 = { false, unit = "A", text = "current at the start" } }, function(self)
  local v, i, list = two_pins(self)
  self:start(i, self.i0)
  return with(list, v ~ self.L*der(i))
end, { text = "v = L i′. Current sources and inductors that alone meet at a node have index 2.",
  source = "Faraday's law of induction",
  example = [[
    m = model { V = e.source{ v = 2 }, L = e.inductor{ L = 4, i0 = 1 }, gnd = e.ground{},
                connect("V.p", "L.p"), connect("V.n", "L.n", "gnd.p") }
    return m:integrate{ to = 6 }(m.L.i, 6)]], gives = "4.0" })

e.saturating_inductor = component("saturating_inductor",
  { L = { 1e-3, unit = "H", text = "inductance at small flux" },
  psis = { 1, unit = "V*s", text = "flux where the current is twice that of L" },
  knee = { 8, text = "its sharpness: an even power" },
  psi0 = { 0, unit = "V*s", text = "flux linkage at the start: remanence" } }, function(self)
  local v, i, list = two_pins(self)
  local psi = self:var("psi", { unit = "V*s", text = "flux linkage" })
  self:start(psi, self.psi0)
  return with(list, v ~ der(psi), i ~ psi/self.L*(1 + (psi/self.psis)^self.knee))
end, { text = "A coil whose iron saturates: v = psi′, i = psi/L (1 + (psi/psis)ⁿ).",
  source = "Hayashi, Nonlinear Oscillations in Physical Systems, 1964: currents as odd powers of the flux",
  example = [[
    m = model { V = e.source{ v = 2 }, L = e.saturating_inductor{ L = 2, psis = 2 }, gnd = e.ground{},
                connect("V.p", "L.p"), connect("V.n", "L.n", "gnd.p") }
    return m:integrate{ to = 1 }(m.L.i, 1)]], gives = "2.0" })

e.source = component("source", { v = { 1, unit = "V", text = "voltage, a number or an expression in t" } },
  function(self)
    self.p, self.n = e.pin, e.pin
    local i = self:var("i", { unit = "A", text = "current" })
    return { self.p.v - self.n.v ~ self.v, i ~ self.p.i, 0 ~ self.p.i + self.n.i }
  end, { text = "A voltage that is given: source{ v = 5*sin(2*pi*50*t) }.", source = "definition",
    example = [[
      m = model { V = e.source{ v = 3 + t }, R = e.resistor{ R = 2 }, gnd = e.ground{},
                  connect("V.p", "R.p"), connect("V.n", "R.n", "gnd.p") }
      return m:init{ from = 1 }(m.R.i)]], gives = "2.0" })

e.current = component("current", { i = { 1, unit = "A", text = "current, a number or an expression in t" } },
  function(self)
    self.p, self.n = e.pin, e.pin
    local v = self:var("v", { unit = "V", text = "voltage" })
    return { v ~ self.p.v - self.n.v, self.p.i ~ self.i, 0 ~ self.p.i + self.n.i }
  end, { text = "A current that is given, from p through the source to n.", source = "definition",
    example = [[
      m = model { I = e.current{ i = 3 }, R = e.resistor{ R = 2 }, gnd = e.ground{},
                  connect("I.n", "R.p"), connect("I.p", "R.n", "gnd.p") }
      return m:init{}(m.R.v)]], gives = "6.0" })

e.signal_source = component("signal_source", {}, function(self)
  self.p, self.n = e.pin, e.pin
  local v, i = self:input("v", { unit = "V" }), self:var("i", { unit = "A", text = "current" })
  return { self.p.v - self.n.v ~ v, i ~ self.p.i, 0 ~ self.p.i + self.n.i }
end, { text = "A voltage that a signal gives: connect(controller.y, source.v).", source = "definition",
  example = [[
    u = input "u"
    m = model { V = e.signal_source{}, R = e.resistor{ R = 2 }, gnd = e.ground{}, connect("V.v", u),
                connect("V.p", "R.p"), connect("V.n", "R.n", "gnd.p") }
    return m:init{ inputs = { u = 5 } }(m.R.i)]], gives = "2.5" })

e.signal_current = component("signal_current", {}, function(self)
  self.p, self.n = e.pin, e.pin
  local i, v = self:input("i", { unit = "A" }), self:var("v", { unit = "V", text = "voltage" })
  return { v ~ self.p.v - self.n.v, self.p.i ~ i, 0 ~ self.p.i + self.n.i }
end, { text = "A current that a signal gives, from p through the source to n.", source = "definition",
  example = [[
    m = model { I = e.signal_current{}, C = e.capacitor{ C = 2, v0 = 0 }, gnd = e.ground{},
                connect("I.i", 4*t), connect("I.n", "C.p"), connect("I.p", "C.n", "gnd.p") }
    return m:integrate{ to = 2 }(m.C.v, 2)]], gives = "4.0" })

-- ── sensors ────────────────────────────────────────────────────────────────────────────────────────────────

e.voltmeter = component("voltmeter", {}, function(self)
  self.p, self.n = e.pin, e.pin
  local v = self:output("v", { unit = "V", text = "voltage" })
  return { v ~ self.p.v - self.n.v, self.p.i ~ 0, self.n.i ~ 0 }
end, { text = "The voltage v as a signal; no current flows.", source = "definition",
  example = [[
    m = model { V = e.source{ v = 6 }, R = e.resistor{ R = 2 }, U = e.voltmeter{}, gnd = e.ground{},
                connect("V.p", "R.p", "U.p"), connect("V.n", "R.n", "U.n", "gnd.p") }
    return m:init{}(m.U.v)]], gives = "6.0" })

e.ammeter = component("ammeter", {}, function(self)
  self.p, self.n = e.pin, e.pin
  local i = self:output("i", { unit = "A", text = "current" })
  return { self.p.v ~ self.n.v, i ~ self.p.i, 0 ~ self.p.i + self.n.i }
end, { text = "The current i from p to n as a signal; no voltage drops.", source = "definition",
  example = [[
    m = model { V = e.source{ v = 6 }, R = e.resistor{ R = 2 }, A = e.ammeter{}, gnd = e.ground{},
                connect("V.p", "A.p"), connect("A.n", "R.p"), connect("V.n", "R.n", "gnd.p") }
    return m:init{}(m.A.i)]], gives = "3.0" })

-- ── semiconductors ─────────────────────────────────────────────────────────────────────────────────────────

e.diode = component("diode", { Is = { 1e-12, unit = "A", text = "saturation current" },
  Vt = { 0.025, unit = "V", text = "thermal voltage times emission coefficient" },
  G = { 1e-9, unit = "S", text = "parallel conductance" } }, function(self)
  local v, i, list = two_pins(self)
  self:guess(v, 0.6)
  return with(list, i ~ self.Is*(exp(v/self.Vt) - 1) + self.G*v)
end, { text = "i = Is (exp(v/Vt) - 1) + G v.", source = "Shockley, Bell Syst. Tech. J. 28(3), 1949",
  example = [[
    m = model { I = e.current{ i = 1e-3 }, D = e.diode{ Is = 1e-9, G = 0 }, gnd = e.ground{},
                connect("I.n", "D.p"), connect("I.p", "D.n", "gnd.p") }
    return m:init{}(m.D.v)]], gives = "0.345387789" })

e.ideal_diode = component("ideal_diode", { Ron = { 1e-5, unit = "Ohm", text = "resistance when it conducts" },
  Goff = { 1e-5, unit = "S", text = "conductance when it blocks" },
  Vknee = { 0, unit = "V", text = "forward voltage" } }, function(self)
  local v, i, list = two_pins(self)
  local s = self:var("s", { text = "place on the characteristic: blocked below 0" })
  self:guess(s, -1)
  return with(list, v ~ ifelse(lt(s, 0), s, self.Ron*s) + self.Vknee,
    i ~ ifelse(lt(s, 0), self.Goff*s, s) + self.Goff*self.Vknee)
end, { text = "A characteristic of two straight lines, blocking and conducting; the change is located as "
  .. "an event.",
  source = "Clauß, Elmqvist, Mattsson, Otter & Schwarz, Modelica Conference 1995: parametrised curves",
  example = [[
    m = model { V = e.source{ v = -2 }, D = e.ideal_diode{ Goff = 0.25 }, gnd = e.ground{},
                connect("V.p", "D.p"), connect("V.n", "D.n", "gnd.p") }
    return m:init{}(m.D.i)]], gives = "-0.5" })

e.mosfet = component("mosfet", { K = { 1e-3, unit = "A/V^2", text = "transconductance" },
  Vth = { 1, unit = "V", text = "threshold" },
  lambda = { 0, unit = "1/V", text = "channel length modulation" },
  G = { 1e-9, unit = "S", text = "parallel conductance: it divides the voltage between two in series that are cut off" } },
  function(self)
    self.d, self.g, self.s = e.pin, e.pin, e.pin
    local i = self:var("i", { unit = "A", text = "drain current" })
    local vds, vgs = self.d.v - self.s.v, self.g.v - self.s.v
    local function drain(over, v)         -- v ≥ 0, over = vgs - Vth
      local triode = self.K*(over*v - v^2/2)
      return ifelse(le(over, 0), 0, ifelse(lt(v, over), triode, self.K/2*over^2)*(1 + self.lambda*v))
    end
    return { i ~ self.G*vds + ifelse(lt(vds, 0), -drain(vgs - vds - self.Vth, -vds),
      drain(vgs - self.Vth, vds)),
      self.d.i ~ i, self.s.i ~ -i, self.g.i ~ 0 }
  end, { text = "n-channel, level 1: cut off, triode, saturated; symmetric in drain and source.",
    source = "Shichman & Hodges, IEEE J. Solid-State Circuits 3(3), 1968",
    example = [[
      m = model { D = e.source{ v = 5 }, G = e.source{ v = 3 }, T = e.mosfet{}, gnd = e.ground{},
                  connect("D.p", "T.d"), connect("G.p", "T.g"), connect("D.n", "G.n", "T.s", "gnd.p") }
      return m:init{}(m.T.i)]], gives = "0.002" })

e.npn = component("npn", { Is = { 1e-16, unit = "A", text = "transport current" }, Vt = { 0.025, unit = "V" },
  Bf = { 100, text = "forward current gain" }, Br = { 1, text = "reverse current gain" } }, function(self)
  self.c, self.b, self.e = e.pin, e.pin, e.pin
  local vbe, vbc = self:var("vbe", { unit = "V" }), self:var("vbc", { unit = "V" })
  self:guess(vbe, 0.6)
  local f, r = self.Is*(exp(vbe/self.Vt) - 1), self.Is*(exp(vbc/self.Vt) - 1)
  return { vbe ~ self.b.v - self.e.v, vbc ~ self.b.v - self.c.v, self.c.i ~ f - r - r/self.Br, self.b.i ~
    f/self.Bf + r/self.Br,
    0 ~ self.c.i + self.b.i + self.e.i }
end, { text = "Bipolar transistor, transport version of Ebers and Moll.",
  source = "Ebers & Moll, Proc. IRE 42(12), 1954",
  example = [[
    m = model { V = e.source{ v = 5 }, I = e.current{ i = 0.01 }, T = e.npn{ Bf = 50 }, gnd = e.ground{},
                connect("V.p", "T.c"), connect("I.n", "T.b"), connect("V.n", "I.p", "T.e", "gnd.p") }
    return m:init{}(m.T.c.i)]], gives = "0.5" })

-- ── amplifiers, transformers ───────────────────────────────────────────────────────────────────────────────

e.opamp = component("opamp", {}, function(self)
  self.p, self.n, self.out = e.pin, e.pin, e.pin
  return { self.p.i ~ 0, self.n.i ~ 0, self.p.v ~ self.n.v }
end, { text = "Ideal: no current and no voltage between the inputs p and n; the output supplies the "
  .. "current and voltage that this needs.",
  source = "Tellegen's nullor; Horowitz & Hill, The Art of Electronics, ch. 4",
  example = [[
    m = model { V = e.source{ v = 1 }, R1 = e.resistor{ R = 1000 }, R2 = e.resistor{ R = 3000 },
                A = e.opamp{}, gnd = e.ground{},
                connect("V.p", "R1.p"), connect("R1.n", "A.n", "R2.p"), connect("R2.n", "A.out"),
                connect("V.n", "A.p", "gnd.p") }
    return m:init{}(m.A.out.v)]], gives = "-3.0" })

e.opamp_limited = component("opamp_limited", { A = { 1e5, text = "gain" },
  Vmax = { 15, unit = "V", text = "largest output" }, Vmin = { -15, unit = "V", text = "smallest output" } },
  function(self)
    self.p, self.n, self.out = e.pin, e.pin, e.pin
    check.ordered(self, "Vmin", "Vmax")
    self:reference(self.out)
    local s = self:var("s", { unit = "V",
      text = "the output without limits" })
    self:guess(s, 0)                                   -- an unknown of its own: loops are solved for it
    return { self.p.i ~ 0, self.n.i ~ 0, self.out.v ~ min(self.Vmax, max(self.Vmin, s)),
      s ~ self.A*(self.p.v - self.n.v) }
  end, { text = "Finite gain and an output that saturates; loops are solved for the output without "
    .. "limits.",
    source = "Horowitz & Hill, The Art of Electronics, ch. 4",
    example = [[
      m = model { V = e.source{ v = 1 }, A = e.opamp_limited{}, gnd = e.ground{}, R = e.resistor{},
                  connect("V.p", "A.p"), connect("A.out", "R.p"), connect("V.n", "A.n", "R.n", "gnd.p") }
      return m:init{}(m.A.out.v)]], gives = "15.0" })

e.transformer = component("transformer", { n = { 1, text = "turns of winding 1 over those of winding 2" } },
  function(self)
    check.not_zero(self, "n")
    self.p1, self.n1, self.p2, self.n2 = e.pin, e.pin, e.pin, e.pin
    self:isolated({ self.p1, self.n1 }, { self.p2, self.n2 })
    return { self.p1.v - self.n1.v ~ self.n*(self.p2.v - self.n2.v), self.p2.i ~ -self.n*self.p1.i,
      0 ~ self.p1.i + self.n1.i, 0 ~ self.p2.i + self.n2.i }
  end, { text = "Ideal: v1 = n v2, i2 = -n i1; each side needs a ground of its own.", source = "definition",
    example = [[
      m = model { V = e.source{ v = 12 }, T = e.transformer{ n = 3 }, R = e.resistor{ R = 2 },
                  g1 = e.ground{}, g2 = e.ground{}, connect("V.p", "T.p1"), connect("V.n", "T.n1", "g1.p"),
                  connect("T.p2", "R.p"), connect("T.n2", "R.n", "g2.p") }
      return m:init{}(m.R.i)]], gives = "2.0" })

e.coupled_inductors = component("coupled_inductors", { L1 = { 1e-3, unit = "H" }, L2 = { 1e-3, unit = "H" },
  M = { 5e-4, unit = "H", text = "mutual inductance, M² < L1 L2" } }, function(self)
  self.p1, self.n1, self.p2, self.n2 = e.pin, e.pin, e.pin, e.pin
  self:isolated({ self.p1, self.n1 }, { self.p2, self.n2 })
  local i1, i2 = self:var("i1", { unit = "A" }), self:var("i2", { unit = "A" })
  return { self.p1.v - self.n1.v ~ self.L1*der(i1) + self.M*der(i2),
    self.p2.v - self.n2.v ~ self.M*der(i1) + self.L2*der(i2),
    i1 ~ self.p1.i, i2 ~ self.p2.i, 0 ~ self.p1.i + self.n1.i, 0 ~ self.p2.i + self.n2.i }
end, { text = "Two windings with a common field.", source = "Faraday's law of induction",
  example = [[
    m = model { V = e.source{ v = 1 }, T = e.coupled_inductors{ L1 = 2, L2 = 8, M = 3 }, U = e.voltmeter{},
                g1 = e.ground{}, g2 = e.ground{}, connect("V.p", "T.p1"), connect("V.n", "T.n1", "g1.p"),
                connect("T.p2", "U.p"), connect("T.n2", "U.n", "g2.p") }
    return m:integrate{ to = 1, start = { ["T.i1"] = 0 } }(m.U.v, 1)]], gives = "1.5" })

e.switch = component("switch", { Ron = { 1e-5, unit = "Ohm" }, Goff = { 1e-5, unit = "S" } }, function(self)
  local v, i, list = two_pins(self)
  local on, s = self:input("on", { text = "closed where it is above 1/2" }), self:var("s")
  return with(list, v ~ ifelse(gt(on, 1/2), self.Ron*s, s), i ~ ifelse(gt(on, 1/2), s, self.Goff*s))
end, { text = "Closed where the signal on is above 1/2.",
  source = "Clauß, Elmqvist, Mattsson, Otter & Schwarz, Modelica Conference 1995",
  example = [[
    m = model { V = e.source{ v = 6 }, S = e.switch{ Ron = 1, Goff = 0.5 }, R = e.resistor{ R = 2 },
                gnd = e.ground{}, connect("S.on", ifelse(lt(t, 1), 0, 1)), connect("V.p", "S.p"),
                connect("S.n", "R.p"), connect("V.n", "R.n", "gnd.p") }
    return m:init{ from = 2 }(m.R.i)]], gives = "2.0" })

return e
