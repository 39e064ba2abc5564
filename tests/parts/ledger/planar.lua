-- Bodies in the plane: every node is a free body; what is rigid hangs a body of its own on a node.
local p = components.planar
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local function plane(f) return f.fx*der(f.x) + f.fy*der(f.y) + f.tau*der(f.phi) end
local between = network.link(plane)

local function body() return p.body{ m = number(), J = number() } end
local function opposite(x) return x.a.fx + x.b.fx end

-- A soft spring from a frame to a node.
local function tie(net, name, frame)
  net:add(name .. "_c", p.spring{ k = number(), s0 = 1 })
  net:join(frame, name .. "_c.a")
  net:wire(net:any(), name .. "_c.b")
end

-- From a node to a body of its own, with a rod behind a hinge.
local function hanging(net, name, part, entry, rod)
  entry.powers, entry.kept = { plane(part.a), plane(part.b) }, opposite
  net:add(name, part, entry)
  net:add(name .. "_m", body())
  net:wire(net:any(), name .. ".a")
  if not rod then return net:join(name .. ".b", name .. "_m.frame") end
  net:add(name .. "_r", p.rod{ dx = number(), dy = number() - 1 })
  net:join(name .. ".b", name .. "_r.a")
  net:join(name .. "_r.b", name .. "_m.frame")
end

local function at_node(net, name, part, entry)
  entry.powers = { plane(part.frame) }
  net:add(name, part, entry)
  net:wire(net:any(), name .. ".frame")
end

local bodies = {
  fixed = function(net, name)
    local x = p.fixed{ x = -5, y = number(), phi = 0.3 }
    net:add(name, x, { powers = { plane(x.frame) } })
    tie(net, name, name .. ".frame")
  end,
  body = function(net, name)
    local x = p.body{ m = number(), J = number(), x0 = -3 - net.nodes, y0 = 7, phi0 = 0.2, vx0 = 0.5, vy0 = 0,
      w0 = 1 }
    net:add(name, x, { powers = { plane(x.frame) }, stored = function(y) return y.energy end })
    tie(net, name, name .. ".frame")
  end,
  rod = function(net, name) hanging(net, name, p.rod{ dx = number(), dy = -1 }, {}) end,
  revolute = function(net, name)
    hanging(net, name, p.revolute{ phi0 = number(), w0 = number() }, {}, true)
  end,
  prismatic = function(net, name)
    hanging(net, name, p.prismatic{ nx = 0.8, ny = -0.6, s0 = number(), v0 = number() - 1 }, {})
  end,
  spring = function(net, name)
    local x = p.spring{ k = number(), d = number()/4, s0 = 2 }
    between(net, name, x, { lost = x.d*der(x.s)^2, kept = opposite,
      stored = function(y) return y.k*(y.s - y.s0)^2/2 end })
  end,
  force = function(net, name)
    local fx, fy, tau = 2*sin(3*t), cos(2*t), number()
    local x = p.force{ fx = fx, fy = fy, tau = tau }
    local f = x.frame
    at_node(net, name, x, { lost = -fx*der(f.x) - fy*der(f.y) - tau*der(f.phi) })
  end,
  wheel = function(net, name)
    local x = p.wheel{ r = number(), x0 = -2 }
    net:add(name, x, { powers = { plane(x.frame) } })
    net:add(name .. "_m", p.body{ m = number(), J = number(), phi0 = 0, w0 = number() - 1 })
    net:join(name .. ".frame", name .. "_m.frame")
    tie(net, name, name .. "_m.frame")
  end,
}
return { recipes = bodies, placed = true, to = 0.5, prepare = function(net)
  for k = 1, net.nodes do
    net:add("B" .. k, p.body{ m = number(), J = number(), x0 = 4*k, y0 = 2*number() + 2, phi0 = 0,
      vx0 = number() - 1, vy0 = 0, w0 = number() - 1 })
    net:wire(k, ("B%d.frame"):format(k))
  end
end }
