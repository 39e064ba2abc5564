-- Process units: what streams bring and take, reactions and heat; every unit is fed by given streams or by
-- the unit before it.
local c = components.process
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local random = math.random

local flow = 0.5
-- A concentration: given, or what a unit before gives.
local function stream(net) return net.streams[random(#net.streams)] end

local function total(x, name, n, last)
  local sum = x[last]
  for k = 1, n - 1 do sum = sum + x[name .. k] end
  return sum
end

local units = {
  reactor = function(net, name)
    local x = c.reactor{ V = number(), k0 = number(), Ea = 2000, dH = -50, rho_c = 10, c0 = number(),
      T0 = 300 }
    local moles = flow*(x.c_in - x.c) - x.V*x.rate
    local heat = flow*x.rho_c*(x.T_in - x.T) + 50*x.V*x.rate
    net:add(name, x, { powers = { moles + heat },
      stored = function(y) return y.V*y.c + y.V*y.rho_c*y.T end })
    net:join(flow, name .. ".q")
    net:join(stream(net), name .. ".c_in")
    net:join(290 + 10*sin(t), name .. ".T_in")
    net.streams[#net.streams + 1] = name .. ".c"
  end,
  plug_flow = function(net, name)
    local n, V, k0 = 1 + random(5), number(), number()
    local x = c.plug_flow{ V = V, k0 = k0, cells = n }
    local inside = V/n*total(x, "c", n, "c")
    net:add(name, x, { powers = { flow*(x.c_in - x.c) - k0*inside },
      stored = function(y) return V/n*total(y, "c", n, "c") end })
    net:join(flow, name .. ".q")
    net:join(stream(net), name .. ".c_in")
    net.streams[#net.streams + 1] = name .. ".c"
  end,
  heat_exchanger = function(net, name)
    local x = c.heat_exchanger{ UA = number(), C1 = number(), C2 = number(), T0 = 300, cells = 1 + random(6),
      counter = random(2) == 1 }
    net:add(name, x, { powers = { 0.7*(x.T1_in - x.T1) + 1.2*(x.T2_in - x.T2) },
      stored = function(y) return y.energy end })
    net:join(0.7, name .. ".w1")
    net:join(1.2, name .. ".w2")
    net:join(350 + 5*cos(t), name .. ".T1_in")
    net:join(290, name .. ".T2_in")
  end,
  mixer = function(net, name)
    net:add(name, c.mixer{}, { powers = {}, kept = function(x)
      return (x.q - x.q1 - x.q2) + (x.q*x.x - x.q1*x.x1 - x.q2*x.x2)
    end })
    for k = 1, 2 do
      net:join(number(), ("%s.q%d"):format(name, k))
      net:join(stream(net), ("%s.x%d"):format(name, k))
    end
    net.streams[#net.streams + 1] = name .. ".x"
  end,
}
return { recipes = units, to = 1.5, prepare = function(net)
  net.streams = { 8, 5 + sin(t), 3*exp(-t) }
end }
