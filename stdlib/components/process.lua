-- Process units: what flows in and out are signals, heat goes through thermal ports.
local component = named "component"
local p = use "components/library" ("process", "reactors, heat exchangers; streams are signals")
local thermal = use "components/thermal"

p.reactor = component("reactor", { V = { 1, unit = "m^3", text = "volume" },
  k0 = { 1, unit = "1/s", text = "rate constant" },
  Ea = { 0, unit = "J/mol", text = "activation energy" },
  gas = { 8.314462618, unit = "J/(mol*K)", text = "gas constant" },
  dH = { 0, unit = "J/mol", text = "heat of reaction, negative where heat is set free" },
  rho_c = { 4.18e6, unit = "J/(m^3*K)", text = "heat capacity of a volume" },
  c0 = { 0, unit = "mol/m^3", text = "concentration at the start" },
  T0 = { 293.15, unit = "K", text = "temperature at the start" } }, function(self)
  local q = self:input("q", { unit = "m^3/s", text = "flow" })
  local c_in = self:input("c_in", { unit = "mol/m^3", text = "concentration of the feed" })
  local T_in = self:input("T_in", { unit = "K", text = "temperature of the feed", default = 293.15 })
  local c = self:output("c", { unit = "mol/m^3", text = "concentration" })
  local T = self:output("T", { unit = "K", text = "temperature" })
  local port = self:optional("port", thermal.port)
  local rate = self:var("rate", { unit = "mol/(m^3*s)", text = "rate of the reaction" })
  self:start(c, self.c0)
  self:start(T, self.T0)
  return { rate ~ self.k0*(self.given.Ea ~= 0 and exp(-self.Ea/(self.gas*T)) or 1)*c,
    self.V*der(c) ~ q*(c_in - c) - self.V*rate,
    self.V*self.rho_c*der(T) ~ q*self.rho_c*(T_in - T) - self.dH*self.V*rate + port.Q, port.T ~ T }
end, { text = "A stirred tank with a reaction of first order, A → B; its heat leaves with the flow and "
  .. "through the port.",
  source = "Levenspiel, Chemical Reaction Engineering, ch. 5 and 9; k = k0 exp(-Ea/(R T)): Arrhenius, 1889",
  example = [[
    x = model { R = e.reactor{ V = 2, k0 = 0.5 }, connect("R.q", 1), connect("R.c_in", 3) }
    return x:integrate{ to = 1, rtol = 1e-8 }(x.R.c, 1)]], gives = "0.9481808382" })

p.plug_flow = component("plug_flow", { V = { 1, unit = "m^3" }, k0 = { 1, unit = "1/s",
  text = "rate constant" },
  cells = { 10, text = "stirred tanks in a row that stand for the pipe" } }, function(self)
  local q, c_in = self:input("q", { unit = "m^3/s" }), self:input("c_in", { unit = "mol/m^3" })
  local n, list, before = self.given.cells, {}, c_in
  for k = 1, n do
    local c = k < n and self:var("c" .. k, { unit = "mol/m^3" }) or self:output("c", { unit = "mol/m^3" })
    self:start(c, 0)
    list[k] = self.V/n*der(c) ~ q*(before - c) - self.V/n*self.k0*c
    before = c
  end
  return list
end, { text = "A tubular reactor as a row of stirred tanks: c = c_in/(1 + k0 V/(n q))ⁿ at rest.",
  source = "Levenspiel, Chemical Reaction Engineering, ch. 6",
  example = [[
    x = model { R = e.plug_flow{ V = 2, k0 = 1, cells = 2 }, connect("R.q", 1), connect("R.c_in", 8) }
    return x:integrate{ to = 40, rtol = 1e-8 }(x.R.c, 40)]], gives = "2.0" })

p.heat_exchanger = component("heat_exchanger", { UA = { 1, unit = "W/K", text = "conductance of the wall" },
  C1 = { 1, unit = "J/K", text = "heat capacity of the fluid on side 1" }, C2 = { 1, unit = "J/K" },
  T0 = { 293.15, unit = "K", text = "temperature at the start" },
  cells = { 10, text = "cells along the wall" },
  counter = { true, text = "false: both fluids flow the same way" } }, function(self)
  local w1, w2 = self:input("w1", { unit = "W/K", text = "mass flow times heat capacity, side 1" }),
    self:input("w2", { unit = "W/K" })
  local before1, before2 = self:input("T1_in", { unit = "K" }), self:input("T2_in", { unit = "K" })
  local n, counter = self.given.cells, self.given.counter
  local T1, T2, list = {}, {}, {}
  for k = 1, n do
    T1[k] = k < n and self:var("T1_" .. k, { unit = "K" }) or self:output("T1", { unit = "K" })
    T2[k] = k < n and self:var("T2_" .. k, { unit = "K" }) or self:output("T2", { unit = "K" })
    self:start(T1[k], self.T0)
    self:start(T2[k], self.T0)
  end
  self.energy = self.C1/n*sum(T1) + self.C2/n*sum(T2)
  for k = 1, n do
    local other = counter and n + 1 - k or k       -- the cell of side 2 across the wall
    local heat = self.UA/n*(T1[k] - T2[other])
    list[#list + 1] = self.C1/n*der(T1[k]) ~ w1*((k == 1 and before1 or T1[k - 1]) - T1[k]) - heat
    list[#list + 1] = self.C2/n*der(T2[other]) ~ w2*((other == 1 and before2 or T2[other - 1]) - T2[other]) +
      heat
  end
  return list
end, { text = "Two fluids along a wall, in cells. At rest, with equal flows in opposite directions, "
  .. "1/(1 + 1/n + "
  .. "w/UA) of the difference is exchanged.",
  source = "Kays & London, Compact Heat Exchangers, ch. 2",
  example = [[
    x = model { X = e.heat_exchanger{ UA = 2, cells = 4, T0 = 0 }, connect("X.w1", 1), connect("X.w2", 1),
                connect("X.T1_in", 70), connect("X.T2_in", 0) }
    return x:integrate{ to = 60 }(x.X.T2, 60)]], gives = "40.0" })

p.mixer = component("mixer", {}, function(self)
  local q1, q2 = self:input("q1", { unit = "m^3/s" }), self:input("q2", { unit = "m^3/s" })
  local x1, x2 = self:input "x1", self:input "x2"
  local q, x = self:output("q", { unit = "m^3/s" }), self:output "x"
  return { q ~ q1 + q2, q*x ~ q1*x1 + q2*x2 }
end, { text = "Two streams become one; x is conserved, a temperature or a concentration.",
  source = "balance of mass",
  example = [[
    x = model { M = e.mixer{}, connect("M.q1", 1), connect("M.x1", 10), connect("M.q2", 3), connect("M.x2",
      50) }
    return x:init{}(x.M.x)]], gives = "40.0" })

return p
