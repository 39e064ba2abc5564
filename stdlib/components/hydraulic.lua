-- Tanks, pipes and pumps: ports with a pressure p and a volume flow q into the part.
local component, connector = named "component", named "connector"
local h = use "components/library" ("hydraulic", "incompressible flow; q counts into the part")
local translational = use "components/translational"

h.port = connector("hydraulic port", { across = { p = "Pa" }, through = { q = "m^3/s" },
  held_by = "an ambient, a tank or an accumulator" })

local function two_ports(self)
  self.a, self.b = h.port, h.port
  local q = self:var("q", { unit = "m^3/s", text = "flow from a to b" })
  local dp = self:var("dp", { unit = "Pa", text = "pressure drop" })
  return q, dp, { self.a.q ~ q, self.b.q ~ -q, dp ~ self.a.p - self.b.p }
end

local function with(list, ...)
  for _, equation in ipairs { ... } do list[#list + 1] = equation end
  return list
end

-- ±√|x|, straight within ±width, so that its slope stays finite.
local function signed_root(x, width)
  return x/(x^2 + width^2)^(1/4)
end

h.ambient = component("ambient", {
  p = { 0, unit = "Pa", text = "pressure, a number or an expression in t" } },
  function(self)
    self.port = h.port
    return { self.port.p ~ self.p }
  end, { text = "A pressure that is given; 0 is that of the air.", source = "definition",
  example = [[
    x = model { A = e.ambient{ p = 2*t }, R = e.pipe{ R = 2 }, B = e.ambient{},
                connect("A.port", "R.a"), connect("R.b", "B.port") }
    return x:init{ from = 3 }(x.R.q)]], gives = "3.0" })

h.tank = component("tank", { A = { 1, unit = "m^2", text = "area" }, rho = { 1000, unit = "kg/m^3" },
  g = { 9.81, unit = "m/s^2" }, h0 = { false, unit = "m", text = "level at the start" } }, function(self)
  self.port = h.port
  local level = self:var("h", { unit = "m", text = "level" })
  self:start(level, self.h0)
  self.volume = self.A*level
  return { self.A*der(level) ~ self.port.q, self.port.p ~ self.rho*self.g*level }
end, { text = "An open tank with its port at the bottom: A h′ = q, p = rho g h.", source = "Pascal, 1663",
  example = [[
    x = model { T = e.tank{ A = 2, h0 = 1 }, P = e.pump{ q = 1 }, R = e.ambient{},
                connect("P.b", "T.port"), connect("P.a", "R.port") }
    return x:integrate{ to = 4 }(x.T.h, 4)]], gives = "3.0" })

h.pipe = component("pipe", { R = { 1e6, unit = "Pa*s/m^3", text = "laminar resistance" } }, function(self)
  local q, dp, list = two_ports(self)
  return with(list, dp ~ self.R*q)
end, { text = "Laminar flow dp = R q, with R = 128 mu l/(pi d⁴).", source = "Hagen 1839, Poiseuille 1840",
  example = [[
    x = model { A = e.ambient{ p = 6 }, R = e.pipe{ R = 2 }, B = e.ambient{},
                connect("A.port", "R.a"), connect("R.b", "B.port") }
    return x:init{}(x.R.q)]], gives = "3.0" })

h.inertance = component("inertance", { I = { 1e6, unit = "kg/m^4", text = "rho l/A" },
  q0 = { false, unit = "m^3/s", text = "flow at the start" } }, function(self)
  local q, dp, list = two_ports(self)
  self:start(q, self.q0)
  return with(list, dp ~ self.I*der(q))
end, { text = "The mass of the fluid in a pipe: dp = I q′.", source = "Euler, 1757",
  example = [[
    x = model { A = e.ambient{ p = 6 }, I = e.inertance{ I = 2, q0 = 1 }, B = e.ambient{},
                connect("A.port", "I.a"), connect("I.b", "B.port") }
    return x:integrate{ to = 2 }(x.I.q, 2)]], gives = "7.0" })

h.orifice = component("orifice", { A = { 1e-4, unit = "m^2", text = "area" },
  Cd = { 0.62, text = "discharge coefficient" }, rho = { 1000, unit = "kg/m^3" },
  dp0 = { 1, unit = "Pa", text = "laminar below this pressure drop" } }, function(self)
  local q, dp, list = two_ports(self)
  return with(list, q ~ self.Cd*self.A*sqrt(2/self.rho)*signed_root(dp, self.dp0))
end, { text = "Turbulent flow q = Cd A √(2 dp/rho), smooth about 0.", source = "Torricelli, 1643",
  example = [[
    x = model { A = e.ambient{ p = 2e4 }, R = e.orifice{ A = 1, Cd = 0.5, rho = 2 }, B = e.ambient{},
                connect("A.port", "R.a"), connect("R.b", "B.port") }
    return ("%.6f"):format(x:init{}(x.R.q))]], gives = "70.710678" })

h.valve = component("valve", { K = { 1e-5, unit = "m^3/(s*Pa^(1/2))", text = "flow coefficient, wide open" },
  dp0 = { 1, unit = "Pa", text = "laminar below this pressure drop" } }, function(self)
  local q, dp, list = two_ports(self)
  local open = self:input("open", { text = "0 closed … 1 open", default = 1 })
  return with(list, q ~ self.K*open*signed_root(dp, self.dp0))
end, { text = "A valve whose opening is a signal.", source = "IEC 60534, incompressible flow",
  example = [[
    x = model { A = e.ambient{ p = 1e8 }, V = e.valve{ K = 0.01 }, B = e.ambient{}, connect("V.open", 0.5),
                connect("A.port", "V.a"), connect("V.b", "B.port") }
    return x:init{}(x.V.q)]], gives = "50.0" })

h.check_valve = component("check_valve", { R = { 1, unit = "Pa*s/m^3", text = "resistance when open" },
  G = { 1e-12, unit = "m^3/(Pa*s)", text = "leakage when closed" } }, function(self)
  local q, dp, list = two_ports(self)
  return with(list, q ~ ifelse(lt(dp, 0), self.G*dp, dp/self.R))
end, { text = "Flow from a to b only.", source = "definition",
  example = [[
    x = model { A = e.ambient{ p = ifelse(lt(t, 1), 6, -6) }, V = e.check_valve{ R = 2, G = 0.5 },
      B = e.ambient{},
                connect("A.port", "V.a"), connect("V.b", "B.port") }
    return x:init{}(x.V.q) + 10*x:init{ from = 2 }(x.V.q)]], gives = "-27.0" })

h.pump = component("pump", {
  q = { 0, unit = "m^3/s", text = "flow from a to b, a number or an expression in t" } },
  function(self)
    self.a, self.b = h.port, h.port
    return { self.a.q ~ self.q, self.b.q ~ -self.q }
  end, { text = "A flow that is given.", source = "definition",
  example = [[
    x = model { A = e.ambient{}, P = e.pump{ q = 2 }, R = e.pipe{ R = 3 }, B = e.ambient{},
                connect("A.port", "P.a"), connect("P.b", "R.a"), connect("R.b", "B.port") }
    return x:init{}(x.P.b.p)]], gives = "6.0" })

h.signal_pump = component("signal_pump", {}, function(self)
  self.a, self.b = h.port, h.port
  local q = self:input("q", { unit = "m^3/s" })
  return { self.a.q ~ q, self.b.q ~ -q }
end, { text = "A flow that a signal gives: connect(controller.y, pump.q).", source = "definition",
  example = [[
    x = model { A = e.ambient{}, P = e.signal_pump{}, T = e.tank{ A = 2, h0 = 1 }, connect("P.q", 4*t),
                connect("A.port", "P.a"), connect("P.b", "T.port") }
    return x:integrate{ to = 2 }(x.T.h, 2)]], gives = "5.0" })

h.centrifugal_pump = component("centrifugal_pump",
  { p0 = { 1e5, unit = "Pa", text = "pressure without flow" },
  qmax = { 1e-3, unit = "m^3/s", text = "flow without pressure" } }, function(self)
  self.a, self.b = h.port, h.port
  local q = self:var("q", { unit = "m^3/s" })
  return { self.a.q ~ q, self.b.q ~ -q, self.b.p - self.a.p ~ self.p0*(1 - q*abs(q)/self.qmax^2) }
end, { text = "A parabola p = p0 (1 - q |q|/qmax²): against a flow backwards the pressure exceeds p0.",
  source = "Pfleiderer, Die Kreiselpumpen, 1924",
  example = [[
    x = model { A = e.ambient{}, P = e.centrifugal_pump{ p0 = 12, qmax = 2 }, R = e.pipe{ R = 9 },
      B = e.ambient{},
                connect("A.port", "P.a"), connect("P.b", "R.a"), connect("R.b", "B.port") }
    return x:init{}(x.P.q)]], gives = "1.0" })

h.accumulator = component("accumulator", { C = { 1e-9, unit = "m^3/Pa", text = "compliance V/K" },
  p0 = { false, unit = "Pa", text = "pressure at the start" } }, function(self)
  self.port = h.port
  local p = self:var("p", { unit = "Pa" })
  self:start(p, self.p0)
  return { p ~ self.port.p, self.C*der(p) ~ self.port.q }
end, { text = "An elastic volume: C p′ = q.", source = "Hooke, for fluids",
  example = [[
    x = model { A = e.ambient{}, P = e.pump{ q = 4 }, V = e.accumulator{ C = 2, p0 = 1 },
                connect("A.port", "P.a"), connect("P.b", "V.port") }
    return x:integrate{ to = 3 }(x.V.p, 3)]], gives = "7.0" })

-- ── oil hydraulics ─────────────────────────────────────────────────────────────────────────────────────────

h.servo_valve = component("servo_valve", { K = { 1e-7, unit = "m^3/(s*Pa^(1/2))",
  text = "flow coefficient of an edge, wide open" },
  dp0 = { 1, unit = "Pa", text = "laminar below this pressure drop" } }, function(self)
  self.supply, self.tank, self.a, self.b = h.port, h.port, h.port, h.port
  local u = self:input("u", { text = "-1 … 1; positive: from the supply to a, from b to the tank" })
  local open, back = max(u, 0), max(-u, 0)
  local function edge(opening, from, to) return self.K*opening*signed_root(from.p - to.p, self.dp0) end
  local pa, pb = edge(open, self.supply, self.a), edge(back, self.supply, self.b)
  local at, bt = edge(back, self.a, self.tank), edge(open, self.b, self.tank)
  return { self.supply.q ~ pa + pb, self.tank.q ~ -at - bt, self.a.q ~ at - pa, self.b.q ~ bt - pb }
end, { text = "Four edges, no overlap: u > 0 joins the supply with a and b with the tank, u < 0 the "
  .. "other way.",
  source = "Merritt, Hydraulic Control Systems, 1967, ch. 5",
  example = [[
    x = model { P = e.ambient{ p = 1e8 }, T = e.ambient{}, V = e.servo_valve{ K = 0.01 },
                R = e.pipe{ R = 1e-3 },
                connect("V.u", -0.5), connect("P.port", "V.supply"), connect("T.port", "V.tank"),
                connect("V.a", "R.a"), connect("V.b", "R.b") }
    return ("%.4f"):format(x:init{}(x.R.q))]], gives = "-35.3553" })

h.cylinder = component("cylinder", { A = { 1e-3, unit = "m^2", text = "area of the piston on the side of a" },
  Ab = { false, unit = "m^2", text = "area on the side of b; A if not given" },
  stroke = { 1, unit = "m" }, V0 = { 1e-4, unit = "m^3", text = "volume of oil on each side at its end" },
  bulk = { 1e9, unit = "Pa", text = "bulk modulus of the oil" },
  pa0 = { 0, unit = "Pa", text = "pressure at a at the start" },
  pb0 = { 0, unit = "Pa", text = "pressure at b at the start" } }, function(self)
  self.a, self.b, self.rod = h.port, h.port, translational.flange
  local s, pa, pb = self:var("s", { unit = "m", text = "travel: 0 … stroke" }),
    self:var("pa", { unit = "Pa" }),
    self:var("pb", { unit = "Pa" })
  self:start(pa, self.pa0)
  self:start(pb, self.pb0)
  local Ab = self.given.Ab and self.Ab or self.A
  local middle = self.stroke/2                       -- beyond an end the volumes mean nothing
  self:event { when = abs(s - middle) - 1.01*middle, direction = 2, action = "stop" }
  return { s ~ self.rod.s, pa ~ self.a.p, pb ~ self.b.p,
    (self.V0 + self.A*s)/self.bulk*der(pa) ~ self.a.q - self.A*der(s),
    (self.V0 + Ab*(self.stroke - s))/self.bulk*der(pb) ~ self.b.q + Ab*der(s),
    self.rod.f ~ Ab*pb - self.A*pa }
end, { text = "Double acting, with compressible oil; the rod is a flange, the stops at the ends are "
  .. "other parts (translational.stop): a run ends where the travel is 1 % beyond the stroke.",
  source = "Merritt, Hydraulic Control Systems, 1967, ch. 6",
  example = [[
    l = components.translational
    x = model { P = e.ambient{ p = 5e5 }, T = e.ambient{}, C = e.cylinder{ A = 2e-3, pa0 = 5e5 },
                w = l.fixed{},
                c = l.spring{ k = 1e4 }, d = l.damper{ d = 1e4 }, m = l.mass{ m = 10, s0 = 0, v0 = 0 },
                connect("P.port", "C.a"), connect("T.port", "C.b"),
                connect("C.rod", "m.flange", "c.b", "d.b"),
                connect("w.flange", "c.a", "d.a") }
    return ("%.6f"):format(x:integrate{ to = 20 }(x.m.s, 20))]],
  gives = "0.100000" })

return h
