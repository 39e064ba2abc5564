-- Shafts and machines: every node is an inertia.
local e, l, r = components.electrical, components.translational, components.rotational
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local electrical = network.electrical
local sliding = network.sliding
local turning = network.turning
local shaft = network.link(turning)
local braking = network.dry(turning, function()
  return r.inertia{ J = number(), phi0 = 0, w0 = number() - 1 }
end)

local function at_shaft(net, name, part, entry, spring)
  entry.powers = entry.powers or { turning(part.flange) }
  net:add(name, part, entry)
  if spring then
    net:add(name .. "_c", r.spring{ c = number() })
    net:join(name .. ".flange", name .. "_c.a")
  end
  net:wire(net:any(), spring and name .. "_c.b" or name .. ".flange")
end

-- Three voltages of 120° around a ground of its own.
local function three_phase(net, name)
  net:add(name .. "_g", e.ground{})
  local n = { name .. "_g.p" }
  for k, pin in ipairs { "a", "b", "c" } do
    net:add(name .. "_" .. pin, e.source{ v = 5*cos(9*t - (k - 1)*2*pi/3) })
    net:join(name .. "_" .. pin .. ".p", name .. "." .. pin)
    n[#n + 1] = name .. "_" .. pin .. ".n"
  end
  net:join(table.unpack(n))
end
local function machine_powers(x)
  return { electrical(x.a), electrical(x.b), electrical(x.c), turning(x.flange) }
end
local function star(x) return x.a.i + x.b.i + x.c.i end
local function balanced(x) return x.a.tau + x.b.tau end

local shafts = {
  fixed = function(net, name) at_shaft(net, name, r.fixed{ phi0 = 1 }, {}, true) end,
  inertia = function(net, name)
    at_shaft(net, name, r.inertia{ J = number(), phi0 = 0, w0 = number() },
      { stored = function(x) return x.J*x.w^2/2 end }, true)
  end,
  spring = function(net, name)
    shaft(net, name, r.spring{ c = number(), phi0 = 0.3 }, { kept = balanced,
      stored = function(x) return x.c*(x.phi - x.phi0)^2/2 end })
  end,
  damper = function(net, name)
    local x = r.damper{ d = number() }
    shaft(net, name, x, { lost = x.d*der(x.phi)^2, kept = balanced })
  end,
  spring_damper = function(net, name)
    local x = r.spring_damper{ c = number(), d = number() }
    shaft(net, name, x, { lost = x.d*der(x.phi)^2, kept = balanced,
      stored = function(y) return y.c*(y.phi - y.phi0)^2/2 end })
  end,
  stop = function(net, name)
    shaft(net, name, r.stop{ c = 40, d = 0, phi0 = -0.5 }, { kept = balanced,
      stored = function(x) return x.c*min(0, x.phi - x.phi0)^2/2 end })
  end,
  torque = function(net, name)
    local x = r.torque{ tau = 2*sin(3*t) }
    at_shaft(net, name, x, { lost = -2*sin(3*t)*der(x.flange.phi) })
  end,
  signal_torque = function(net, name)
    local x = r.signal_torque{}
    at_shaft(net, name, x, { lost = -cos(2*t)*der(x.flange.phi) })
    net:join(name .. ".tau", cos(2*t))
  end,
  angle = function(net, name)
    local x = r.angle{ phi = sin(t) }
    at_shaft(net, name, x, { lost = x.flange.tau*cos(t) }, true)
  end,
  speed = function(net, name)
    local x = r.speed{ w = cos(2*t) }
    at_shaft(net, name, x, { lost = x.flange.tau*cos(2*t) }, true)
  end,
  sensor = function(net, name) at_shaft(net, name, r.sensor{}, {}) end,
  speed_sensor = function(net, name) at_shaft(net, name, r.speed_sensor{}, {}) end,
  gear = function(net, name)
    local x = r.gear{ ratio = number() }
    net:add(name, x, { powers = { turning(x.a), turning(x.b) } })
    net:wire(net:any(), name .. ".a")
    net:add(name .. "_c", r.spring{ c = number() })
    net:join(name .. ".b", name .. "_c.a")
    net:wire(net:any(), name .. "_c.b")
  end,
  planetary = function(net, name)
    local x = r.planetary{ ratio = 1 + number() }
    net:add(name, x, { powers = { turning(x.sun), turning(x.carrier), turning(x.ring) } })
    for _, wheel in ipairs { "sun", "carrier", "ring" } do
      net:add(name .. "_" .. wheel, r.spring{ c = number() })
      net:join(name .. "." .. wheel, name .. "_" .. wheel .. ".a")
      net:wire(net:any(), name .. "_" .. wheel .. ".b")
    end
    net:add(name .. "_J", r.inertia{ J = 1, phi0 = 0, w0 = 0 })    -- two wheels of the three are free
    net:add(name .. "_K", r.inertia{ J = 2, phi0 = 0, w0 = 0 })
    net:join(name .. ".sun", name .. "_J.flange")
    net:join(name .. ".ring", name .. "_K.flange")
  end,
  rack = function(net, name)
    local x = r.rack{ r = number() }
    at_shaft(net, name, x, { powers = { turning(x.flange), sliding(x.slide) } })
    net:add(name .. "_c", l.spring{ k = number() })
    net:add(name .. "_w", l.fixed{})
    net:join(name .. ".slide", name .. "_c.a")
    net:join(name .. "_c.b", name .. "_w.flange")
  end,
  dc_motor = function(net, name)
    local x = r.dc_motor{ R = number(), L = number(), k = number() }
    at_shaft(net, name, x, { powers = { electrical(x.p), electrical(x.n), turning(x.flange) },
      lost = x.R*x.i^2,
      kept = function(y) return y.p.i + y.n.i end, stored = function(y) return y.L*y.i^2/2 end })
    net:add(name .. "_V", e.source{ v = 3 })
    net:add(name .. "_g", e.ground{})
    net:join(name .. "_V.p", name .. ".p")
    net:join(name .. "_V.n", name .. ".n", name .. "_g.p")
  end,
  induction_motor = function(net, name)
    local x = r.induction_motor{ Rs = 1, Rr = 0.7, Ls = 0.5, Lr = 0.6, Lm = 0.4 }
    local function phasors(y) return y.i_alpha, y.i_beta, y.ir_alpha, y.ir_beta end
    local sa, sb, ra, rb = phasors(x)
    at_shaft(net, name, x, { powers = machine_powers(x), kept = star,
      lost = 3/2*(x.Rs*(sa^2 + sb^2) + x.Rr*(ra^2 + rb^2)),
      stored = function(y)
        local a, b, c, d = phasors(y)
        return 3/2*(y.Ls*(a^2 + b^2)/2 + y.Lr*(c^2 + d^2)/2 + y.Lm*(a*c + b*d))
      end })
    three_phase(net, name)
  end,
  synchronous_motor = function(net, name)
    local x = r.synchronous_motor{ R = 1, Ld = 0.5, Lq = 0.8, psi = 0.3 }
    at_shaft(net, name, x, { powers = machine_powers(x), kept = star, lost = 3/2*x.R*(x.i_d^2 + x.i_q^2),
      stored = function(y) return 3/2*(y.Ld*y.i_d^2 + y.Lq*y.i_q^2)/2 end })
    three_phase(net, name)
  end,
  friction = function(net, name)
    local x = r.friction{ tau0 = 0.4 }
    braking(net, name, x, { kept = balanced, lost = 0.4*abs(x.w) })
  end,
  clutch = function(net, name)
    local x = r.clutch{ tau0 = 0.8 }
    braking(net, name, x, { kept = balanced, lost = 0.8*(0.6 + 0.3*sin(t))*abs(x.w) })
    net:join(name .. ".u", 0.6 + 0.3*sin(t))
  end,
}
return { recipes = shafts, to = 1.5, prepare = function(net)
  for k = 1, net.nodes do
    net:add("J" .. k, r.inertia{ J = number(), phi0 = 0, w0 = number() - 1 })
    net:wire(k, ("J%d.flange"):format(k))
  end
end }
