-- Circuits: every node has a capacitor and a conductor to ground.
local e = components.electrical
local network = dofile "tests/parts/ledger/network.lua"
local number, random = network.number, math.random
local electrical = network.electrical

local function two_pins(part) return { electrical(part.p), electrical(part.n) } end
local function charge(part) return part.p.i + part.n.i end

-- Between two nodes; with a resistor of its own where the part gives a voltage.
local function between(net, name, part, entry, resistor)
  entry.powers, entry.kept = two_pins(part), charge
  net:add(name, part, entry)
  local a = net:any()
  local b = a % net.nodes + 1
  net:wire(a, name .. ".p")
  if resistor then
    net:add(name .. "_R", e.resistor{ R = number() })
    net:join(name .. ".n", name .. "_R.p")
    net:wire(b, name .. "_R.n")
  else
    net:wire(b, name .. ".n")
  end
end

local function windings(net, name, part, entry)
  entry.powers = { electrical(part.p1), electrical(part.n1), electrical(part.p2), electrical(part.n2) }
  entry.kept = function(x) return x.p1.i + x.n1.i + 2*(x.p2.i + x.n2.i) end
  net:add(name, part, entry)
  net:wire(1, name .. ".n1")
  net:wire(1, name .. ".n2")
  for side = 1, 2 do
    net:add(name .. "_R" .. side, e.resistor{ R = number() })
    net:join(("%s.p%d"):format(name, side), ("%s_R%d.p"):format(name, side))
    net:wire(net:any(), ("%s_R%d.n"):format(name, side))
  end
end

-- An amplifier as a follower; its output is fed from elsewhere, so that nothing balances but its inputs.
local function follower(net, name, part)
  net:add(name, part, { powers = { electrical(part.p), part.n.i*part.n.v },
    kept = function(x) return x.p.i + 2*x.n.i end })
  net:add(name .. "_R", e.resistor{ R = number() })
  net:wire(net:any(), name .. ".p")
  net:join(name .. ".out", name .. ".n", name .. "_R.p")
  net:wire(net:any(), name .. "_R.n")
end

local circuit = {
  ground = function(net, name)
    net:add(name, e.ground{})
    net:wire(1, name .. ".p")
  end,
  resistor = function(net, name)
    local x = e.resistor{ R = number() }
    between(net, name, x, { lost = x.R*x.i^2 })
  end,
  conductor = function(net, name)
    local x = e.conductor{ G = number() }
    between(net, name, x, { lost = x.G*x.v^2 })
  end,
  capacitor = function(net, name)
    between(net, name, e.capacitor{ C = number() }, { stored = function(x) return x.C*x.v^2/2 end })
  end,
  inductor = function(net, name)
    between(net, name, e.inductor{ L = number(), i0 = number() },
      { stored = function(x) return x.L*x.i^2/2 end })
  end,
  saturating_inductor = function(net, name)
    between(net, name, e.saturating_inductor{ L = number(), psis = 0.5, knee = 4 },
      { stored = function(x) return (x.psi^2/2 + x.psi^6/(6*x.psis^4))/x.L end })
  end,
  source = function(net, name)
    local u = number()*sin(random(3)*t)
    local x = e.source{ v = u }
    between(net, name, x, { lost = u*x.i }, true)
  end,
  signal_source = function(net, name)
    local x = e.signal_source{}
    between(net, name, x, { lost = 2*cos(t)*x.i }, true)
    net:join(name .. ".v", 2*cos(t))
  end,
  current = function(net, name)
    local i = number()*cos(random(3)*t)
    local x = e.current{ i = i }
    between(net, name, x, { lost = i*x.v })
  end,
  signal_current = function(net, name)
    local x = e.signal_current{}
    between(net, name, x, { lost = sin(2*t)*x.v })
    net:join(name .. ".i", sin(2*t))
  end,
  voltmeter = function(net, name) between(net, name, e.voltmeter{}, {}) end,
  ammeter = function(net, name) between(net, name, e.ammeter{}, {}, true) end,
  diode = function(net, name)
    local x = e.diode{ Is = 1e-3, Vt = 0.5, G = 0.1 }
    between(net, name, x, { lost = x.v*(x.Is*(exp(x.v/x.Vt) - 1) + x.G*x.v),
      positive = function(y) return y.v*y.i end })
  end,
  ideal_diode = function(net, name)
    local x = e.ideal_diode{ Ron = 0.1, Goff = 0.1 }
    between(net, name, x, { lost = ifelse(lt(x.s, 0), x.Goff*x.v^2, x.Ron*x.i^2),
      positive = function(y) return y.v*y.i end }, true)
  end,
  switch = function(net, name)
    local x = e.switch{ Ron = 0.1, Goff = 0.1 }
    between(net, name, x, { lost = ifelse(gt(sin(3*t), 0), x.Ron*x.i^2, x.Goff*x.v^2) }, true)
    net:join(name .. ".on", ifelse(gt(sin(3*t), 0), 1, 0))
  end,
  mosfet = function(net, name)
    local x = e.mosfet{ K = 0.2, Vth = 0.3, lambda = 0.1, G = 0.1 }
    net:add(name, x, { powers = { electrical(x.d), electrical(x.g), electrical(x.s) },
      lost = x.i*(x.d.v - x.s.v),
      kept = function(y) return y.d.i + y.g.i + y.s.i end,
      positive = function(y) return y.i*(y.d.v - y.s.v) end })
    for _, pin in ipairs { "d", "g", "s" } do net:wire(net:any(), name .. "." .. pin) end
  end,
  npn = function(net, name)
    local x = e.npn{ Is = 1e-3, Vt = 0.5, Bf = 10 }
    local f, b = x.Is*(exp(x.vbe/x.Vt) - 1), x.Is*(exp(x.vbc/x.Vt) - 1)
    net:add(name, x, { powers = { electrical(x.c), electrical(x.b), electrical(x.e) },
      lost = (x.vbe - x.vbc)*(f - b) + x.vbe*f/x.Bf + x.vbc*b/x.Br,
      kept = function(y) return y.c.i + y.b.i + y.e.i end })
    for _, pin in ipairs { "c", "b", "e" } do net:wire(net:any(), name .. "." .. pin) end
  end,
  opamp = function(net, name) follower(net, name, e.opamp{}) end,
  opamp_limited = function(net, name) follower(net, name, e.opamp_limited{ A = 50, Vmax = 1, Vmin = -1 }) end,
  transformer = function(net, name) windings(net, name, e.transformer{ n = number() }, {}) end,
  coupled_inductors = function(net, name)
    windings(net, name, e.coupled_inductors{ L1 = 2, L2 = 3, M = 1.5 },
      { stored = function(x) return x.L1*x.i1^2/2 + x.L2*x.i2^2/2 + x.M*x.i1*x.i2 end })
  end,
}
return { recipes = circuit, to = 2, prepare = function(net)
  circuit.ground(net, "gnd")
  for k = 2, net.nodes do
    net:add("C" .. k, e.capacitor{ C = number(), v0 = random(3) - 2 })
    net:wire(k, ("C%d.p"):format(k))
    net:wire(1, ("C%d.n"):format(k))
    net:add("G" .. k, e.conductor{ G = 0.1 })
    net:wire(k, ("G%d.p"):format(k))
    net:wire(1, ("G%d.n"):format(k))
  end
end }
