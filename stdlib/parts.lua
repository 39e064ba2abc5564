-- Models from parts: component, connector, connect, model. What they do is loaded when the first part is
-- made:
-- parts/kinds.lua connectors, parts/scope.lua what a part consists of, parts/names.lua names by path,
-- parts/joints.lua connections, parts/flat.lua the equations of all parts together, parts/report.lua trees
-- and
-- diagrams, parts/adapt.lua other models as parts. The libraries are in components/, one file a domain.

-- A file of the library whose value is made once.
local made = {}
function use(name)
  if made[name] == nil then made[name] = include(name) end
  return made[name]
end

local function parts() return use "parts/api" end

-- What takes a model takes a model of parts: the equations that it is integrated with.
function as_model(value)
  if type(value) == "table" and getmetatable(value) == "part" then return parts().as_model(value) end
  return value
end

local module, title = "parts", "Models from parts"

doc { name = "component", module = module, title = title,
  sig = "component(name, defaults, function(self) … end [, { text =, source =, example = }]) -> component",
  text = [[A kind of part. defaults are its parameters: numbers, { 100, unit = "Ohm" }, or whatever self.given
    hands to the function. The function declares connectors (self.p = kind), variables (self:vars "v i"),
    parts (self.R = resistor{}), start values (self:start(v, 0)) and returns its equations and connections.
    It runs once for every place the part has in a model. Calling the component makes a part.]],
  example = [[
    pin = components.electrical.pin
    lossy = component("lossy", { C = 1, G = 1 }, function(self)
      self.p, self.n = pin, pin
      local v = self:var "v"
      return { v ~ self.p.v - self.n.v, self.p.i ~ self.C*der(v) + self.G*v, 0 ~ self.p.i + self.n.i }
    end)
    e = components.electrical
    m = model { x = lossy{ C = 2 }, gnd = e.ground{}, connect("x.n", "gnd.p"), connect "x.p" }
    return m:dof()]], gives = "1",
  function(...) return parts().component(...) end }

doc { name = "connector", module = module, title = title,
  sig = "connector(name, { across = { v = \"V\" }, through = { i = \"A\" } }) -> kind of connector",
  text = [[Connected connectors have equal across variables, and their through variables add up to 0 (into the
    part counts positive). Units are text; a variable with several components is { unit, size }. Options:
    reference = true where one potential must be fixed, as in circuits.]],
  example = 'connector("shaft", { across = { w = "rad/s" }, through = { tau = "N*m" } })',
  gives = "connector shaft: across w [rad/s], through tau [N*m]",
  options = { option("across", "list or table", 'variables that are equal where connected: { v = "V" }'),
    option("through", "list or table", "variables that add up to 0 there"),
    option("reference", "string or boolean", "the across variable that is 0 at the ground"),
    option("pairs", "table", "which through variable belongs to an across variable"),
    option("idle", "table", "{ phi = 0 }: an angle where only parts meet that call self:idle(connector)"),
    option("held_by", "string", 'the parts that fix a potential, for messages: "a fixed point or a mass"') },
  options_at = 2,
  function(...) return parts().connector(...) end }

doc { name = "connect", module = module, title = title,
  sig = 'connect(a, b, …) -> connection',
  text = [[An entry of model{ … } or of the table that a component's function returns: these connectors are
    joined. Each is a connector (R.p, self.R.p), its path as text ("R.p"), or an input or output of a signal.
    connect(R.p) alone says that this connector stays open.]],
  example = [[
    e = components.electrical
    return connect(e.resistor{}.p, e.resistor{}.n)]], gives = "connect(resistor.p, resistor_2.n)",
  function(...) return parts().connect(...) end }

doc { name = "model", module = module, title = title,
  sig = "model{ name = part, …, connect(…), equation, …, start =, guess =, events = } -> model",
  text = [[Parts by name, connections and equations. The names of variables are paths: m.C.v is C.v in
    equations, ledgers, plots and errors. Parts are components, models of parts, dae, lagrange, ss and tf
    models, and lists of these; each entry is a copy of its own. Everything that a dae model answers, m
    answers: m:index() and m:structure() refer to all equations, m:reduce(), m:init() and m:integrate() to
    those left after aliases and trivial equations are eliminated. m:tree() and m:diagram() show it.]],
  example = [[
    e = components.electrical
    V, R, C = e.source{ v = 1 }, e.resistor{ R = 2 }, e.capacitor{ C = 0.5, v0 = 0 }
    rc = model { V = V, R = R, C = C, gnd = e.ground{},
                 connect(V.p, R.p), connect(R.n, C.p), connect(C.n, V.n, "gnd.p") }
    return ("%.6f"):format(rc:integrate{ to = 1 }(rc.C.v, 1))]], gives = "0.632121",
  function(...) return parts().model(...) end }

doc { name = "model:ports", module = module, title = title,
  sig = "chain:ports{ name = { kind, across = expression } } -> part",
  text = [[A lagrange model as a part with connectors: { flange, s = q[1] } joins a position that depends
    on the coordinates; a force there enters the equations of motion as the generalised force of this
    position.]],
  example = [[
    l = components.translational
    q = var "q"
    bob = lagrange{ q = {q}, T = q.dot^2 }:ports{ tip = { l.flange, s = 2*q } }
    m = model { P = bob, F = l.force{ f = 3 }, connect("P.tip", "F.flange") }
    return m:dae().equations[1] ]], gives = "2 P.q″ = 2 F.f",
  function(...) return use("parts/adapt").with_ports(...) end }

-- The libraries in the order of help(); name, what its connectors are.
local domains = {
  { "electrical", "Circuits: pins with a potential v and a current i into the part", "resistor" },
  { "translational", "Motion along a line: flanges with a position s and a force f on the part", "mass" },
  { "rotational", "Shafts: flanges with an angle phi and a torque tau on the part", "inertia" },
  { "planar", "Bodies in the plane: frames with x, y, phi and fx, fy, tau on the part", "body" },
  { "spatial", "Bodies in space: frames with r, unit quaternions q, f and n on the part", "body" },
  { "thermal", "Heat: ports with a temperature T and a heat flow Q into the part", "capacity" },
  { "hydraulic", "Tanks, pipes, pumps: ports with a pressure p and a volume flow q into the part", "tank" },
  { "process", "Process units: reactors, heat exchangers, mixers; streams are signals", "reactor" },
  { "signals", "Signals: sources, controllers, filters, sampling, state machines", "pid" },
}

for _, domain in ipairs(domains) do
  local name, text, part = domain[1], domain[2], domain[3]
  doc { name = "components." .. name, module = module, title = title, sig = "components." .. name,
    text = text .. ". print(components." .. name .. ") lists the parts; print(part) has its equations.",
    example = ("return components.%s.%s ~= nil"):format(name, part), gives = "true",
    describe = function(row)  -- help "clutch" and apropos "clutch" find the part
      local parts, words = {}, {}
      for part_name, made in components[name]() do
        parts[#parts + 1] = part_name
        words[#words + 1] = part_name:gsub("_", " ") .. " " .. (rawget(made, "text") or "")
      end
      row.parts, row.words = parts, table.concat(words, " ")
    end,
    load = function() return use("components/" .. name) end }
end
