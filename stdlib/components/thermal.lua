-- Heat: ports with a temperature T and a heat flow Q into the part.
local component, connector = named "component", named "connector"
local h = use "components/library" ("thermal", "heat conduction; Q counts into the part")
local electrical = use "components/electrical"

h.port = connector("heat port", { across = { T = "K" }, through = { Q = "W" },
  held_by = "a temperature or a capacity" })

local fourier = "Fourier, Théorie analytique de la chaleur, 1822"

local function two_ports(self)
  self.a, self.b = h.port, h.port
  local Q = self:var("Q", { unit = "W", text = "heat flow from a to b" })
  return Q, { self.a.Q ~ Q, self.b.Q ~ -Q }
end

local function with(list, ...)
  for _, equation in ipairs { ... } do list[#list + 1] = equation end
  return list
end

h.capacity = component("capacity", { C = { 1, unit = "J/K", text = "heat capacity" },
  T0 = { false, unit = "K", text = "temperature at the start" } }, function(self)
  self.port = h.port
  local T = self:var("T", { unit = "K", text = "temperature" })
  self:start(T, self.T0)
  self.energy = self.C*T
  return { T ~ self.port.T, self.C*der(T) ~ self.port.Q }
end, { text = "C T′ = Q.", source = fourier,
  example = [[
    x = model { C = e.capacity{ C = 2, T0 = 300 }, Q = e.heat_flow{ Q = 4 }, connect("C.port", "Q.port") }
    return x:integrate{ to = 10 }(x.C.T, 10)]], gives = "320.0" })

h.conductor = component("conductor", { G = { 1, unit = "W/K", text = "thermal conductance" } }, function(self)
  local Q, list = two_ports(self)
  return with(list, Q ~ self.G*(self.a.T - self.b.T))
end, { text = "Q = G (T_a - T_b): conduction, or convection with G = alpha A.", source = fourier,
  example = [[
    x = model { A = e.temperature{ T = 400 }, G = e.conductor{ G = 2 }, B = e.temperature{ T = 300 },
                connect("A.port", "G.a"), connect("G.b", "B.port") }
    return x:init{}(x.G.Q)]], gives = "200.0" })

h.resistor = component("resistor", { R = { 1, unit = "K/W", text = "thermal resistance" } }, function(self)
  local Q, list = two_ports(self)
  return with(list, self.a.T - self.b.T ~ self.R*Q)
end, { text = "T_a - T_b = R Q.", source = fourier,
  example = [[
    x = model { A = e.temperature{ T = 400 }, R = e.resistor{ R = 2 }, B = e.temperature{ T = 300 },
                connect("A.port", "R.a"), connect("R.b", "B.port") }
    return x:init{}(x.R.Q)]], gives = "50.0" })

h.radiation = component("radiation", { G = { 1, unit = "m^2", text = "net radiation area" },
  sigma = { 5.670374419e-8, unit = "W/(m^2*K^4)", text = "Stefan-Boltzmann constant" } }, function(self)
  local Q, list = two_ports(self)
  return with(list, Q ~ self.G*self.sigma*(self.a.T^4 - self.b.T^4))
end, { text = "Q = G sigma (T_a⁴ - T_b⁴).", source = "Stefan 1879, Boltzmann 1884",
  example = [[
    x = model { A = e.temperature{ T = 2 }, G = e.radiation{ sigma = 1 }, B = e.temperature{ T = 1 },
                connect("A.port", "G.a"), connect("G.b", "B.port") }
    return x:init{}(x.G.Q)]], gives = "15.0" })

h.temperature = component("temperature", { T = { 293.15, unit = "K",
  text = "temperature, a number or an expression in t" } }, function(self)
  self.port = h.port
  return { self.port.T ~ self.T }
end, { text = "A temperature that is given.", source = "definition",
  example = [[
    x = model { A = e.temperature{ T = 300 + 2*t }, G = e.conductor{ G = 3 }, B = e.temperature{ T = 300 },
                connect("A.port", "G.a"), connect("G.b", "B.port") }
    return x:init{ from = 5 }(x.G.Q)]], gives = "30.0" })

h.heat_flow = component("heat_flow", {
  Q = { 0, unit = "W", text = "heat flow, a number or an expression in t" } },
  function(self)
    self.port = h.port
    return { self.port.Q ~ -self.Q }
  end, { text = "A heat flow that is given.", source = "definition",
  example = [[
    x = model { Q = e.heat_flow{ Q = 6 }, R = e.resistor{ R = 2 }, B = e.temperature{ T = 300 },
                connect("Q.port", "R.a"), connect("R.b", "B.port") }
    return x:init{}(x.Q.port.T)]], gives = "312.0" })

h.signal_heat_flow = component("signal_heat_flow", {}, function(self)
  self.port = h.port
  local Q = self:input("Q", { unit = "W" })
  return { self.port.Q ~ -Q }
end, { text = "A heat flow that a signal gives.", source = "definition",
  example = [[
    x = model { Q = e.signal_heat_flow{}, C = e.capacity{ C = 2, T0 = 300 }, connect("Q.Q", 6*t),
                connect("Q.port", "C.port") }
    return x:integrate{ to = 2 }(x.C.T, 2)]], gives = "306.0" })

h.sensor = component("sensor", {}, function(self)
  self.port = h.port
  local T = self:output("T", { unit = "K" })
  return { T ~ self.port.T, self.port.Q ~ 0 }
end, { text = "The temperature as a signal.", source = "definition",
  example = [[
    x = model { C = e.capacity{ C = 1, T0 = 300 }, G = e.conductor{ G = 1 }, B = e.temperature{ T = 400 },
      s = e.sensor{},
                connect("C.port", "G.a", "s.port"), connect("G.b", "B.port") }
    return x:integrate{ to = 1 }(x.s.T, 1)]], gives = "363.2120558829" })

h.heating_resistor = component("heating_resistor", { R = { 1, unit = "Ohm", text = "resistance at Tref" },
  alpha = { 0, unit = "1/K", text = "temperature coefficient" }, Tref = { 293.15, unit = "K" } },
    function(self)
  self.p, self.n, self.port = electrical.pin, electrical.pin, h.port
  local v, i = self:var("v", { unit = "V" }), self:var("i", { unit = "A" })
  return { v ~ self.p.v - self.n.v, i ~ self.p.i, 0 ~ self.p.i + self.n.i,
    v ~ self.R*(1 + self.alpha*(self.port.T - self.Tref))*i, self.port.Q ~ -v*i }
end, { text = "A resistor whose loss is a heat flow out of its port.", source = "Joule, Phil. Mag. 19, 1841",
  example = [[
    el = components.electrical
    x = model { V = el.source{ v = 10 }, R = e.heating_resistor{ R = 5 }, C = e.capacity{ C = 2, T0 = 300 },
                gnd = el.ground{}, connect("V.p", "R.p"), connect("V.n", "R.n", "gnd.p"),
                connect("R.port", "C.port") }
    return x:integrate{ to = 1 }(x.C.T, 1)]], gives = "310.0" })

return h
