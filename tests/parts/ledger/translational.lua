-- Motion along a line: every node is a mass.
local l = components.translational
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local sliding = network.sliding
local link = network.link
local line = link(sliding)

local rubbing = network.dry(sliding, function() return l.mass{ m = number(), s0 = 0, v0 = number() - 1 } end)

-- At one mass; with a spring between where the part gives the motion.
local function at_mass(net, name, part, entry, spring)
  entry.powers = { sliding(part.flange) }
  net:add(name, part, entry)
  if spring then
    net:add(name .. "_c", l.spring{ k = number() })
    net:join(name .. ".flange", name .. "_c.a")
  end
  net:wire(net:any(), spring and name .. "_c.b" or name .. ".flange")
end

local function opposite(x) return x.a.f + x.b.f end

local motion = {
  mass = function(net, name)
    at_mass(net, name, l.mass{ m = number(), s0 = number(), v0 = number() },
      { stored = function(x) return x.m*x.v^2/2 end }, true)
  end,
  fixed = function(net, name) at_mass(net, name, l.fixed{ s0 = number() }, {}, true) end,
  spring = function(net, name)
    line(net, name, l.spring{ k = number(), s0 = 1 }, { kept = opposite,
      stored = function(x) return x.k*(x.s - x.s0)^2/2 end })
  end,
  damper = function(net, name)
    local x = l.damper{ d = number() }
    line(net, name, x, { lost = x.d*der(x.s)^2, kept = opposite })
  end,
  spring_damper = function(net, name)
    local x = l.spring_damper{ k = number(), d = number(), s0 = 1 }
    line(net, name, x, { lost = x.d*der(x.s)^2, kept = opposite,
      stored = function(y) return y.k*(y.s - y.s0)^2/2 end })
  end,
  stop = function(net, name)
    line(net, name, l.stop{ k = 40, d = 0, s0 = -0.5 }, { kept = opposite,
      stored = function(x) return x.k*min(0, x.s - x.s0)^2/2 end })
  end,
  force = function(net, name)
    local x = l.force{ f = 2*sin(3*t) }
    at_mass(net, name, x, { lost = -2*sin(3*t)*der(x.flange.s) })
  end,
  signal_force = function(net, name)
    local x = l.signal_force{}
    at_mass(net, name, x, { lost = -cos(2*t)*der(x.flange.s) })
    net:join(name .. ".f", cos(2*t))
  end,
  position = function(net, name)
    local x = l.position{ s = sin(t) }
    at_mass(net, name, x, { lost = x.flange.f*cos(t) }, true)
  end,
  sensor = function(net, name) at_mass(net, name, l.sensor{}, {}) end,
  lever = function(net, name)
    local x = l.lever{ ratio = number() }
    net:add(name, x, { powers = { sliding(x.a), sliding(x.b) } })
    net:wire(net:any(), name .. ".a")
    net:add(name .. "_c", l.spring{ k = number() })
    net:join(name .. ".b", name .. "_c.a")
    net:wire(net:any(), name .. "_c.b")
  end,
  mass_with_stops = function(net, name)
    at_mass(net, name, l.mass_with_stops{ m = number(), e = 0.9, v0 = 2, smax = 0.5, smin = -0.5 },
      { stored = function(x) return x.m*x.v^2/2 end, at_least = true }, true)
  end,
  friction = function(net, name)
    local x = l.friction{ F = 0.5 }
    rubbing(net, name, x, { kept = opposite, lost = 0.5*abs(x.v) })
  end,
}
return { recipes = motion, to = 1.5, prepare = function(net)
  for k = 1, net.nodes do
    net:add("M" .. k, l.mass{ m = number(), s0 = k, v0 = number() - 1 })
    net:wire(k, ("M%d.flange"):format(k))
  end
end }
