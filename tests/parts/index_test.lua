-- Index and free initial values of networks, against what theory says: 1 without loops of capacitors and
-- voltage
-- sources and without cutsets of inductors and current sources, 2 with them (Tischendorf, 1999); one state
-- less for
-- each; 3 where masses are rigidly coupled at their positions, 2 where a damper differentiates a position.
local e, l, r = components.electrical, components.translational, components.rotational
local h, w = components.thermal, components.hydraulic
local R, C, L, V, I, G = e.resistor{}, e.capacitor{ C = 1 }, e.inductor{ L = 1 }, e.source{ v = sin(t) },
  e.current{ i = sin(t) }, e.ground{}

-- Two-pole parts in a loop: each entry is one, n to p of the next; the ground is where the last meets the
-- first.
local function loop(list)
  local items = { gnd = G }
  for k, part in ipairs(list) do
    items["x" .. k] = part
    items[#items + 1] = connect("x" .. k .. ".n", ("x%d.p"):format(k % #list + 1))
  end
  items[#items + 1] = connect("gnd.p", "x1.p")
  return model(items)
end

-- The same parts between two nodes.
local function parallel(list)
  local items, p, n = { gnd = G }, {}, { "gnd.p" }
  for k, part in ipairs(list) do
    items["x" .. k], p[k], n[k + 1] = part, "x" .. k .. ".p", "x" .. k .. ".n"
  end
  items[1], items[2] = connect(table.unpack(p)), connect(table.unpack(n))
  return model(items)
end

local function chain(parts, connections)
  local items = {}
  for k, part in ipairs(parts) do items["x" .. k] = part end
  for _, ends in ipairs(connections) do items[#items + 1] = connect(table.unpack(ends)) end
  return model(items)
end

local m, J = l.mass{}, r.inertia{}
local tank, cap = w.tank{}, h.capacity{}

local cases = {
  { "RC", 1, 1, loop{ V, R, C } }, { "RL", 1, 1, loop{ V, R, L } },
    { "RLC in series", 1, 2, loop{ V, R, L, C } },
  { "LC", 1, 2, loop{ L, C } }, { "RLC in parallel", 1, 2, parallel{ I, R, L, C } },
  { "resistors only", 1, 0, loop{ V, R, R } }, { "C at a voltage source", 2, 0, loop{ V, C } },
  { "two C in parallel", 2, 1, parallel{ I, R, C, C } },
    { "three C in parallel", 2, 1, parallel{ I, R, C, C, C } },
  { "loop of V, C, C", 2, 1, loop{ V, C, C } }, { "C, C and R, then V", 1, 2, loop{ V, R, C, C } },
  { "L at a current source", 2, 0, loop{ I, L } }, { "two L in series", 2, 1, loop{ V, R, L, L } },
  { "two L in parallel", 1, 2, parallel{ V, L, L } }, { "current source into C", 1, 1, loop{ I, C } },
  { "V and L", 1, 1, loop{ V, L } },
  { "opamp integrator", 1, 1, chain({ V, R, C, e.opamp{}, G },
    { { "x1.p", "x2.p" }, { "x2.n", "x3.p", "x4.n" },
    { "x3.n", "x4.out" }, { "x1.n", "x4.p", "x5.p" } }) },
  { "opamp differentiator", 2, 0, chain({ V, C, R, e.opamp{}, G },
    { { "x1.p", "x2.p" }, { "x2.n", "x3.p", "x4.n" },
    { "x3.n", "x4.out" }, { "x1.n", "x4.p", "x5.p" } }) },
  { "mass", 1, 2, chain({ m, l.force{ f = 1 } }, { { "x1.flange", "x2.flange" } }) },
  { "mass and spring", 1, 2, chain({ m, l.spring{}, l.fixed{} },
    { { "x1.flange", "x2.b" }, { "x2.a", "x3.flange" } }) },
  { "two masses and a spring", 1, 4, chain({ m, l.spring{}, m },
    { { "x1.flange", "x2.a" }, { "x2.b", "x3.flange" } }) },
  { "mass and damper", 2, 2, chain({ m, l.damper{}, l.fixed{} },
    { { "x1.flange", "x2.b" }, { "x2.a", "x3.flange" } }) },
  { "two masses rigidly coupled", 3, 2, chain({ m, m }, { { "x1.flange", "x2.flange" } }) },
  { "mass with a given motion", 3, 0, chain({ m, l.position{ s = sin(t) } },
    { { "x1.flange", "x2.flange" } }) },
  { "lever between masses", 3, 2, chain({ m, l.lever{ ratio = 2 }, m },
    { { "x1.flange", "x2.a" }, { "x2.b", "x3.flange" } }) },
  { "gear between inertias", 3, 2, chain({ J, r.gear{ ratio = 3 }, J },
    { { "x1.flange", "x2.a" }, { "x2.b", "x3.flange" } }) },
  { "planetary gear and three inertias", 3, 4, chain({ J, r.planetary{}, J, J }, { { "x1.flange", "x2.sun" },
    { "x2.carrier", "x3.flange" }, { "x2.ring", "x4.flange" } }) },
  { "torsion spring between inertias", 1, 4, chain({ J, r.spring{}, J },
    { { "x1.flange", "x2.a" }, { "x2.b", "x3.flange" } }) },
  { "inertia with a given speed", 3, 1, chain({ J, r.speed{ w = 1 } }, { { "x1.flange", "x2.flange" } }) },
  { "heat", 1, 1, chain({ cap, h.conductor{}, h.temperature{} },
    { { "x1.port", "x2.a" }, { "x2.b", "x3.port" } }) },
  { "two capacities in contact", 2, 1, chain({ cap, cap, h.heat_flow{ Q = 1 } },
    { { "x1.port", "x2.port", "x3.port" } }) },
  { "capacity at a temperature", 2, 0, chain({ cap, h.temperature{ T = sin(t) } },
    { { "x1.port", "x2.port" } }) },
  { "tanks and a pipe", 1, 2, chain({ tank, w.pipe{}, tank },
    { { "x1.port", "x2.a" }, { "x2.b", "x3.port" } }) },
  { "two tanks in contact", 2, 1, chain({ tank, tank, w.pipe{}, w.ambient{} },
    { { "x1.port", "x2.port", "x3.a" },
    { "x3.b", "x4.port" } }) },
  { "pump into an inertance", 2, 0, chain({ w.ambient{}, w.pump{ q = sin(t) }, w.inertance{}, w.ambient{} },
    { { "x1.port", "x2.a" }, { "x2.b", "x3.a" }, { "x3.b", "x4.port" } }) },
}

-- Several domains. A motor differentiates the angle of its flange: 2, with rotor and load rigidly coupled 3;
-- a
-- given current takes its state. Heat and current meet in a resistor that becomes warm.
local function drive(source, ...)
  local parts, ends = { source, r.dc_motor{}, G, ... },
    { { "x1.p", "x2.p" }, { "x1.n", "x2.n", "x3.p" } }
  return parts, ends
end
local function motor(source, parts, ends)
  local all, list = drive(source, table.unpack(parts))
  for _, more in ipairs(ends) do list[#list + 1] = more end
  return chain(all, list)
end
local warm = h.heating_resistor{ R = 2, alpha = 0.01 }
local mixed = {
  { "motor and load", 2, 3, motor(V, { J }, { { "x2.flange", "x4.flange" } }) },
  { "motor, gear and rigid load", 3, 3, motor(V, { J, r.gear{ ratio = 5 }, J },
    { { "x2.flange", "x4.flange", "x5.a" }, { "x5.b", "x6.flange" } }) },
  { "motor, elastic shaft and load", 2, 5, motor(V, { J, r.spring{}, J },
    { { "x2.flange", "x4.flange", "x5.a" }, { "x5.b", "x6.flange" } }) },
  { "motor with a given current", 2, 2, chain({ I, r.dc_motor{}, G, J },
    { { "x1.p", "x2.p" }, { "x1.n", "x2.n", "x3.p" }, { "x2.flange", "x4.flange" } }) },
  { "motor that turns a rack and a mass", 3, 3, motor(V, { J, r.rack{ r = 0.1 }, m },
    { { "x2.flange", "x4.flange", "x5.flange" }, { "x5.slide", "x6.flange" } }) },
  { "motor whose shaft is held", 2, 1, motor(V, { r.fixed{} }, { { "x2.flange", "x4.flange" } }) },
  { "warm resistor and its capacity", 1, 1, chain({ V, warm, G, cap, h.conductor{}, h.temperature{} },
    { { "x1.p", "x2.p" }, { "x1.n", "x2.n", "x3.p" }, { "x2.port", "x4.port", "x5.a" },
    { "x5.b", "x6.port" } }) },
  { "warm resistor at a temperature", 1, 0, chain({ V, warm, G, h.temperature{} },
    { { "x1.p", "x2.p" }, { "x1.n", "x2.n", "x3.p" }, { "x2.port", "x4.port" } }) },
  { "pump into a tank", 1, 1, chain({ w.ambient{}, w.pump{ q = 1 }, tank },
    { { "x1.port", "x2.a" }, { "x2.b", "x3.port" } }) },
  { "tank at a pressure", 2, 0, chain({ w.ambient{ p = t }, tank }, { { "x1.port", "x2.port" } }) },
  { "tank, inertance, tank", 1, 3, chain({ tank, w.inertance{}, tank },
    { { "x1.port", "x2.a" }, { "x2.b", "x3.port" } }) },
}
table.move(mixed, 1, #mixed, #cases + 1, cases)

for _, case in ipairs(cases) do
  local name, index, dof, network = table.unpack(case)
  test(("%s: index %d, %d free initial values"):format(name, index, dof), function()
    expect(network:index()):equals(index)
    expect(network:dof()):equals(dof)
    expect(network:dae():dof()):equals(dof)          -- elimination keeps the free initial values
    expect(network:dae():index() <= index):is_true()
  end)
end
