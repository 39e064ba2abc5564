-- Fluids: every node is an elastic volume.
local l, w = components.translational, components.hydraulic
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local fluid = network.fluid
local sliding = network.sliding
local duct = network.link(fluid)
local function flow_kept(x) return x.a.q + x.b.q end

-- Pressures of some Pa and flows of some m³/s: the laws have no scale of their own.
local fluids = {
  ambient = function(net, name)
    local x = w.ambient{ p = 3 + sin(t) }
    net:add(name, x, { powers = { fluid(x.port) }, lost = (3 + sin(t))*x.port.q })
    net:add(name .. "_R", w.pipe{ R = number() })
    net:join(name .. ".port", name .. "_R.a")
    net:wire(net:any(), name .. "_R.b")
  end,
  tank = function(net, name)
    local x = w.tank{ A = number(), rho = 1, g = 2, h0 = number() }
    net:add(name, x, { powers = { fluid(x.port) }, stored = function(y) return y.rho*y.g*y.A*y.h^2/2 end })
    net:add(name .. "_R", w.pipe{ R = number() })
    net:join(name .. ".port", name .. "_R.a")
    net:wire(net:any(), name .. "_R.b")
  end,
  accumulator = function(net, name)
    local x = w.accumulator{ C = number(), p0 = number() }
    net:add(name, x, { powers = { fluid(x.port) }, stored = function(y) return y.C*y.p^2/2 end })
    net:add(name .. "_R", w.pipe{ R = number() })
    net:join(name .. ".port", name .. "_R.a")
    net:wire(net:any(), name .. "_R.b")
  end,
  pipe = function(net, name)
    local x = w.pipe{ R = number() }
    duct(net, name, x, { lost = x.R*x.a.q^2, kept = flow_kept })
  end,
  inertance = function(net, name)
    local x = w.inertance{ I = number(), q0 = number() }
    duct(net, name, x, { kept = flow_kept, stored = function(y) return y.I*y.a.q^2/2 end })
  end,
  pump = function(net, name)
    local x = w.pump{ q = sin(2*t) }
    duct(net, name, x, { lost = sin(2*t)*(x.a.p - x.b.p), kept = flow_kept })
  end,
  signal_pump = function(net, name)
    local x = w.signal_pump{}
    duct(net, name, x, { lost = cos(2*t)*(x.a.p - x.b.p), kept = flow_kept })
    net:join(name .. ".q", cos(2*t))
  end,
  centrifugal_pump = function(net, name)
    local x = w.centrifugal_pump{ p0 = 9, qmax = 2 }
    net:add(name, x, { powers = { fluid(x.a), fluid(x.b) }, lost = -x.q*x.p0*(1 - (x.q/x.qmax)^2),
      kept = flow_kept })
    net.guess[name .. ".q"] = 1
    net:add(name .. "_R", w.pipe{ R = number() })
    net:join(name .. ".b", name .. "_R.a")
    local a = net:any()
    net:wire(a, name .. ".a")
    net:wire(a % net.nodes + 1, name .. "_R.b")
  end,
  servo_valve = function(net, name)
    local x = w.servo_valve{ K = 0.3, dp0 = 0.1 }
    local ports = { x.supply, x.tank, x.a, x.b }
    local powers = {}
    for k, port in ipairs(ports) do powers[k] = fluid(port) end
    net:add(name, x, { powers = powers, at_least = true,
      kept = function(y) return y.supply.q + y.tank.q + y.a.q + y.b.q end })
    net:join(name .. ".u", sin(3*t))
    for _, port in ipairs { "supply", "tank", "a", "b" } do net:wire(net:any(), name .. "." .. port) end
  end,
  cylinder = function(net, name)
    local x = w.cylinder{ A = 0.5, Ab = 0.4, V0 = 1, bulk = 20, pa0 = 1, pb0 = 1 }
    net:add(name, x, { powers = { fluid(x.a), fluid(x.b), sliding(x.rod) },
      lost = (x.V0 + x.A*x.s)/x.bulk*x.pa*der(x.pa) + (x.V0 + x.Ab*(x.stroke - x.s))/x.bulk*x.pb*der(x.pb) })
    for _, port in ipairs { "a", "b" } do
      net:add(name .. "_R" .. port, w.pipe{ R = number() })
      net:join(name .. "." .. port, name .. "_R" .. port .. ".a")
      net:wire(net:any(), name .. "_R" .. port .. ".b")
    end
    net:add(name .. "_m", l.mass{ m = 1, s0 = 0.4, v0 = 0 })
    net:add(name .. "_c", l.spring_damper{ k = 20, d = 1, s0 = 0.4 })
    net:add(name .. "_w", l.fixed{})
    net:join(name .. ".rod", name .. "_m.flange", name .. "_c.b")
    net:join(name .. "_c.a", name .. "_w.flange")
  end,
}
-- Flow from a to b by a law of the pressure drop.
local function throttle(make, law)
  return function(net, name)
    local x = make()
    local dp = x.a.p - x.b.p
    duct(net, name, x, { lost = dp*law(x, dp), kept = flow_kept,
      positive = function(y) return (y.a.p - y.b.p)*y.a.q end })
  end
end
fluids.check_valve = throttle(function() return w.check_valve{ R = number(), G = 0.01 } end,
  function(x, dp) return ifelse(lt(dp, 0), x.G*dp, dp/x.R) end)
fluids.orifice = throttle(function() return w.orifice{ A = 0.3, rho = 2, dp0 = 0.1 } end,
  function(x) return x.a.q end)
fluids.valve = throttle(function() return w.valve{ K = 0.3, dp0 = 0.1 } end, function(x) return x.a.q end)
return { recipes = fluids, to = 1.5, prepare = function(net)
  for k = 1, net.nodes do
    net:add("V" .. k, w.accumulator{ C = number(), p0 = number() })
    net:wire(k, ("V%d.port"):format(k))
  end
end }
