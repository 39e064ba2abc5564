-- Signals: every block takes what is given or what another block gives, and has to keep its law. What has a
-- memory is integrated: the change of its state against the integral of what enters.
local s = components.signals
local network = dofile "tests/parts/ledger/network.lua"
local number = network.number
local random = math.random

-- A signal of the network: an expression in t, or the output of a block that stands before.
local function signal(net) return net.signals[random(#net.signals)] end

-- Adds the block with inputs from the network; entry.kept gets the part and its inputs.
local function block(net, name, part, entry, inputs)
  entry.powers = entry.powers or {}
  net:add(name, part, entry)
  for _, input in ipairs(inputs or { "u" }) do
    net:join(signal(net), ("%s.%s"):format(name, input))
  end
  net.signals[#net.signals + 1] = name .. ".y"
end

-- A wave whose value at the ticks is known: { expression, function }.
local function wave()
  local w, phase = number(), random(6)
  return sin(w*t + phase), function(time) return math.sin(w*time + phase) end
end

-- The tick before a time, for ticks at 0, Ts, …; times that are asked for are no multiples of Ts.
local function held(time, Ts) return math.floor(time/Ts)*Ts end

local function limits(u, low, high) return min(high, max(low, u)) end

local toggle = { { from = 1, to = 2, when = function(u) return u[1] end },
  { from = 2, to = 1, when = function(u) return -u[1] end } }

local blocks = {
  gain = function(net, name)
    block(net, name, s.gain{ k = number() }, { kept = function(x) return x.y - x.k*x.u end })
  end,
  sum = function(net, name)
    block(net, name, s.sum{ signs = "+-+" }, { kept = function(x) return x.y - x.u1 + x.u2 - x.u3 end },
      { "u1", "u2", "u3" })
  end,
  product = function(net, name)
    block(net, name, s.product{}, { kept = function(x) return x.y - x.u1*x.u2 end }, { "u1", "u2" })
  end,
  saturation = function(net, name)
    block(net, name, s.saturation{ low = -0.3, high = 0.5 },
      { kept = function(x) return x.y - limits(x.u, -0.3, 0.5) end })
  end,
  dead_zone = function(net, name)
    block(net, name, s.dead_zone{ low = -0.3, high = 0.2 },
      { kept = function(x) return x.y - x.u + limits(x.u, -0.3, 0.2) end })
  end,
  table = function(net, name)               -- |u| within 2, as a table
    block(net, name, s.table{ x = { -2, 0, 2 }, y = { 2, 0, 2 } },
      { kept = function(x) return x.y - min(2, abs(x.u)) end })
  end,
  integrator = function(net, name)
    local x = s.integrator{ k = number(), y0 = number() }
    block(net, name, x, { powers = { x.k*x.u }, stored = function(y) return y.y end })
  end,
  first_order = function(net, name)
    local x = s.first_order{ k = number(), T = number(), y0 = 0.5 }
    block(net, name, x, { powers = { x.k*x.u - x.y }, stored = function(y) return y.T*y.y end })
  end,
  filter = function(net, name)
    local x = s.filter{ w = number(), D = number() }
    block(net, name, x, { powers = { x.w^2*(x.u - x.y) },
      stored = function(y) return der(y.y) + 2*y.D*y.w*y.y end })
  end,
  derivative = function(net, name)          -- y + T y′ = k u′
    local x = s.derivative{ k = 2, T = 0.3 }
    block(net, name, x, { powers = { x.y }, stored = function(y) return 2*y.u - 0.3*y.y end })
  end,
  delay = function(net, name)               -- what is on its way: ∫ (u - y) = 12/T x1
    local x = s.delay{ T = 0.5 }
    block(net, name, x, { powers = { x.u - x.y }, stored = function(y) return 12/0.5*y.x1 end })
  end,
  pid = function(net, name)
    local x = s.pid{ k = 2, Ti = 0.7, Td = 0.2, N = 5, low = -1, high = 1.5, Tt = 0.4 }
    local free = 2*(x.r - x.v) + x.z - 2*5*(x.v - x.x)
    block(net, name, x, { powers = { 2/0.7*(x.r - x.v) + (x.y - free)/0.4 },
      stored = function(y) return y.z end, kept = function(y)
        return y.y - limits(2*(y.r - y.v) + y.z - 2*5*(y.v - y.x), -1, 1.5)
      end }, { "r", "v" })
  end,
  sampler = function(net, name)
    local u, at = wave()
    local x = s.sampler{ Ts = 0.23 }
    net:add(name, x, { powers = {}, check = function(sol, y, time)
      return sol(y.y, time) - at(held(time, 0.23))
    end })
    net:join(u, name .. ".u")
    net.signals[#net.signals + 1] = name .. ".y"
  end,
  unit_delay = function(net, name)
    local u, at = wave()
    net:add(name, s.unit_delay{ Ts = 0.23 }, { powers = {}, check = function(sol, y, time)
      local before = held(time, 0.23) - 0.23
      return sol(y.y, time) - (before > -0.1 and at(before) or 0)
    end })
    net:join(u, name .. ".u")
    net.signals[#net.signals + 1] = name .. ".y"
  end,
  discrete_pi = function(net, name)
    local u, at = wave()
    net:add(name, s.discrete_pi{ Ts = 0.19, k = 2, Ti = 0.5 }, { powers = {}, check = function(sol, y, time)
      local z, n = 0, math.floor(time/0.19)
      for k = 0, n - 1 do z = z + 2*0.19/0.5*at(0.19*k) end
      return sol(y.y, time) - 2*at(0.19*n) - z
    end })
    net:join(u, name .. ".r")
    net:join(0, name .. ".v")
    net.signals[#net.signals + 1] = name .. ".y"
  end,
  pulse = function(net, name)
    net:add(name, s.pulse{ period = 0.37, width = 0.3, low = -1, high = 2 }, { powers = {},
      check = function(sol, y, time) return sol(y.y, time) - (time % 0.37 < 0.3*0.37 and 2 or -1) end })
    net.signals[#net.signals + 1] = name .. ".y"
  end,
  relay = function(net, name)               -- on from asin(0.4) on, off again behind π + asin(0.2)
    net:add(name, s.relay{ low = -0.2, high = 0.4, on = 3, off = -1 }, { powers = {},
      check = function(sol, y, time)
        local phase = 4*time % (2*math.pi)
        local on = phase > math.asin(0.4) and phase < math.pi + math.asin(0.2)
        return sol(y.y, time) - (on and 3 or -1)
      end })
    net:join(sin(4*t), name .. ".u")
    net.signals[#net.signals + 1] = name .. ".y"
  end,
  state_machine = function(net, name)
    net:add(name, s.state_machine{ transitions = toggle, y = { -2, 5 } }, { powers = {},
      check = function(sol, y, time) return sol(y.y, time) - (math.sin(3*time + 1) > 0 and 5 or -2) end })
    net:join(sin(3*t + 1), name .. ".u1")
    net.signals[#net.signals + 1] = name .. ".y"
  end,
}
return { recipes = blocks, to = 1.5, prepare = function(net)
  net.signals = { sin(2*t), cos(3*t), 0.7*t - 0.4 }
end }
