-- Bodies in space: every node is a free body; a joint hangs a body of its own on a node.
local s = components.spatial
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local function space(f) return dot(f.f, der(f.r)) + dot(f.n, der(f.q)) end
local between = network.link(space)

local function body() return s.body{ m = number(), J = { number(), number(), number() } } end
local function opposite(x) return x.a.f[1] + x.b.f[1] end

local function tie(net, name, frame)
  net:add(name .. "_c", s.spring{ k = number(), s0 = 1 })
  net:join(frame, name .. "_c.a")
  net:wire(net:any(), name .. "_c.b")
end

local function upright(net, name)
  for key, value in pairs { q1 = 1, r1 = 3, r2 = 1, r3 = -1 } do net.guess[name .. "." .. key] = value end
end

local function hanging(net, name, part, rod)
  net:add(name, part, { powers = { space(part.a), space(part.b) }, kept = opposite })
  local m = name .. "_m"
  net:add(m, body())
  upright(net, m)
  net:wire(net:any(), name .. ".a")
  if not rod then return net:join(name .. ".b", m .. ".frame") end
  net:add(name .. "_r", s.rod{ d = { number(), number(), -number() } })
  net:join(name .. ".b", name .. "_r.a")
  net:join(name .. "_r.b", m .. ".frame")
end

local function axis() return ({ "x", "y", "z" })[math.random(3)] end

local bodies = {
  fixed = function(net, name)
    local x = s.fixed{ r = { -5, 1, 2 }, q = { 0.6, 0, 0.8, 0 } }
    net:add(name, x, { powers = { space(x.frame) } })
    tie(net, name, name .. ".frame")
  end,
  body = function(net, name)
    local x = s.body{ m = number(), J = { 1, 2, 2.5 }, r0 = { -4 - net.nodes, 6, 1 }, v0 = { 0.5, 0, 0 },
      q0 = { 1, 0, 0, 0 }, w0 = { 1, 0.2, 0.3 } }
    net:add(name, x, { powers = { space(x.frame) }, stored = function(y) return y.energy end })
    tie(net, name, name .. ".frame")
  end,
  rod = function(net, name) hanging(net, name, s.rod{ d = { number(), 0.3, -1 } }) end,
  spherical = function(net, name) hanging(net, name, s.spherical{}, true) end,
  revolute = function(net, name) hanging(net, name, s.revolute{ axis = axis() }, true) end,
  universal = function(net, name) hanging(net, name, s.universal{}, true) end,
  prismatic = function(net, name) hanging(net, name, s.prismatic{ axis = axis() }) end,
  weld = function(net, name) hanging(net, name, s.weld{}) end,
  spring = function(net, name)
    local x = s.spring{ k = number(), d = number()/4, s0 = 2 }
    between(net, name, x, { lost = x.d*der(x.s)^2, kept = opposite,
      stored = function(y) return y.k*(y.s - y.s0)^2/2 end })
  end,
  drive = function(net, name)
    local r = components.rotational
    local x = s.drive{ axis = "y" }
    net:add(name, x, { powers = { space(x.a), space(x.b), network.turning(x.flange) }, kept = function(y)
      return sum { y.a.f[1], y.b.f[1] }
    end })
    net:add(name .. "_j", s.revolute{ axis = "y" })
    net:add(name .. "_r", s.rod{ d = { number(), 0.2, 0.1 } })
    net:add(name .. "_m", body())
    net:add(name .. "_J", r.inertia{ J = number(), phi0 = 0, w0 = number() - 1 })
    net:add(name .. "_T", r.torque{ tau = number()*sin(3*t) })
    upright(net, name .. "_m")
    net:wire(net:any(), name .. ".a")
    net:join(name .. "_j.a", name .. ".a")
    net:join(name .. "_j.b", name .. ".b", name .. "_r.a")
    net:join(name .. "_r.b", name .. "_m.frame")
    net:join(name .. ".flange", name .. "_J.flange", name .. "_T.flange")
  end,
  force = function(net, name)
    local f = { 2*sin(3*t), cos(2*t), number() }
    local x = s.force{ f = f }
    local given = 0
    for k = 1, 3 do given = given + f[k]*der(x.frame.r[k]) end
    net:add(name, x, { powers = { space(x.frame) }, lost = -given })
    net:wire(net:any(), name .. ".frame")
  end,
}
return { recipes = bodies, placed = true, to = 0.3, nodes = 2, parts = 3, prepare = function(net)
  for k = 1, net.nodes do
    net:add("B" .. k, s.body{ m = number(), J = { number(), number(), number() }, r0 = { 4*k, number(), 0 },
      v0 = { 0, number() - 1, 0 }, q0 = { 1, 0, 0, 0 }, w0 = { 0.1*k, 0.2, -0.3 } })
    net:wire(k, ("B%d.frame"):format(k))
  end
end }
