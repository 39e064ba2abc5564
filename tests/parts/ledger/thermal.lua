-- Heat: every node is a capacity.
local e, h = components.electrical, components.thermal
local network = dofile "tests/parts/ledger/network.lua"
local number, random = network.number, math.random
local electrical = network.electrical
local heat = network.heat
local wall = network.link(heat)
local function charge(x) return x.p.i + x.n.i end

local warmth = {
  capacity = function(net, name)
    local x = h.capacity{ C = number(), T0 = 280 + random(40) }
    net:add(name, x, { powers = { heat(x.port) }, stored = function(y) return y.C*y.T end })
    net:add(name .. "_G", h.conductor{ G = number() })
    net:join(name .. ".port", name .. "_G.a")
    net:wire(net:any(), name .. "_G.b")
  end,
  conductor = function(net, name) wall(net, name, h.conductor{ G = number() }, {}) end,
  resistor = function(net, name) wall(net, name, h.resistor{ R = number() }, {}) end,
  radiation = function(net, name) wall(net, name, h.radiation{ G = number() }, {}) end,
  temperature = function(net, name)
    local x = h.temperature{ T = 300 + 9*sin(t) }
    net:add(name, x, { powers = { heat(x.port) }, lost = heat(x.port) })
    net:add(name .. "_G", h.conductor{ G = number() })
    net:join(name .. ".port", name .. "_G.a")
    net:wire(net:any(), name .. "_G.b")
  end,
  heat_flow = function(net, name)
    local x = h.heat_flow{ Q = 9*sin(t) }
    net:add(name, x, { powers = { heat(x.port) }, lost = -9*sin(t) })
    net:wire(net:any(), name .. ".port")
  end,
  signal_heat_flow = function(net, name)
    local x = h.signal_heat_flow{}
    net:add(name, x, { powers = { heat(x.port) }, lost = -9*cos(t) })
    net:join(name .. ".Q", 9*cos(t))
    net:wire(net:any(), name .. ".port")
  end,
  sensor = function(net, name)
    local x = h.sensor{}
    net:add(name, x, { powers = { heat(x.port) } })
    net:wire(net:any(), name .. ".port")
  end,
  heating_resistor = function(net, name)
    local x = h.heating_resistor{ R = number(), alpha = 0.01 }
    net:add(name, x, { powers = { electrical(x.p), electrical(x.n), heat(x.port) }, kept = charge })
    net:wire(net:any(), name .. ".port")
    net:add(name .. "_V", e.source{ v = 3*sin(t) })
    net:add(name .. "_g", e.ground{})
    net:join(name .. "_V.p", name .. ".p")
    net:join(name .. "_V.n", name .. ".n", name .. "_g.p")
  end,
}
return { recipes = warmth, to = 2, prepare = function(net)
  for k = 1, net.nodes do
    net:add("C" .. k, h.capacity{ C = number(), T0 = 280 + random(40) })
    net:wire(k, ("C%d.port"):format(k))
  end
end }
