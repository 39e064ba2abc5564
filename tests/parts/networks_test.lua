-- Random networks of 3 to 50 parts of every library: what flows in, is stored and is lost adds up to 0.
-- The balance is a variable of the model, W′ = power, so that it is exact over events, too.
local e, l, r = components.electrical, components.translational, components.rotational
local p, s3, h = components.planar, components.spatial, components.thermal
local w, c, s = components.hydraulic, components.process, components.signals
local random, W = math.random, var "W"

local function trials(title, seeds, body)
  for seed in seeds:gmatch "%d+" do
    test(("%s, seed %s"):format(title, seed), function()
      math.randomseed(tonumber(seed))
      body()
    end)
  end
end

local function one_of(list) return list[random(#list)] end
local function number() return 0.5 + random(8)/4 end

-- ── circuits ───────────────────────────────────────────────────────────────────────────────────────────────

trials("circuit with transformers, coupled inductors, diodes and switches", "1 2 3 4 5 6", function()
  local nodes, parts = 3 + random(6), 6 + random(24)
  local items, at, power, stored = { gnd = e.ground{} }, {}, 0, {}
  for k = 1, nodes do at[k] = {} end
  at[1][1] = "gnd.p"
  local function put(k, part, ends, a, b)
    items["x" .. k] = part
    table.insert(at[a], ("x%d.%s"):format(k, ends[1]))
    table.insert(at[b], ("x%d.%s"):format(k, ends[2]))
  end
  for k = 1, parts do
    local a = k < nodes and k + 1 or random(nodes)
    local b = k < nodes and random(k) or (a + random(nodes - 1) - 1) % nodes + 1
    local choice = k < nodes and random(2) or random(9)
    local part, ends = nil, { "p", "n" }
    if choice == 1 then part = e.resistor{ R = number() }
    elseif choice == 2 then part = e.conductor{ G = number() }
    elseif choice == 3 then
      part = e.capacitor{ C = number() }
      stored[#stored + 1] = function(x) return x.C*x.v^2/2 end
    elseif choice == 4 then
      part = e.inductor{ L = number(), i0 = 0 }
      stored[#stored + 1] = function(x) return x.L*x.i^2/2 end
    elseif choice == 5 then part = e.current{ i = number()*sin(random(3)*t) }
    elseif choice == 6 then part = e.diode{ Is = 1e-3, Vt = 0.5, G = 0.1 }
    elseif choice == 7 then part = e.ideal_diode{ Ron = 0.1, Goff = 0.1 }
    elseif choice == 8 then
      part, ends = e.transformer{ n = number() }, { "p1", "n1" }
      table.insert(at[random(nodes)], ("x%d.p2"):format(k))
      items["load" .. k] = e.resistor{ R = number() }
      items[#items + 1] = connect(("x%d.n2"):format(k), ("load%d.p"):format(k))
      table.insert(at[random(nodes)], ("load%d.n"):format(k))
      power = power + items["load" .. k].v*items["load" .. k].i
    else
      part, ends = e.coupled_inductors{ L1 = 2, L2 = 3, M = 1.5 }, { "p1", "n1" }
      table.insert(at[random(nodes)], ("x%d.p2"):format(k))
      items["load" .. k] = e.resistor{ R = number() }
      items[#items + 1] = connect(("x%d.n2"):format(k), ("load%d.p"):format(k))
      table.insert(at[random(nodes)], ("load%d.n"):format(k))
      power = power + items["load" .. k].v*items["load" .. k].i
      stored[#stored + 1] = function(x) return x.L1*x.i1^2/2 + x.L2*x.i2^2/2 + x.M*x.i1*x.i2 end
      stored[#stored + 1] = false
    end
    if choice < 3 or choice > 4 and choice < 8 then power = power + part.p.v*part.p.i + part.n.v*part.n.i end
    if stored[#stored] == false then stored[#stored] = nil end
    if choice == 3 or choice == 4 or choice == 9 then stored[#stored] = { "x" .. k, stored[#stored] } end
    put(k, part, ends, a, b)
  end
  for k = 1, nodes do items[#items + 1] = connect(table.unpack(at[k])) end
  items[#items + 1] = der(W) ~ power
  local m = model(items)
  local low = m:dae():index() > 1 and m:reduce() or m:dae()
  local guess = {}
  for k = 1, #low.differential do guess[low.differential[k]] = 0 end
  local sol = low:integrate{ start = low:init{ guess = guess }, to = 2, rtol = 1e-8, atol = 1e-10 }
  expect(sol.status):equals "finished"
  local energy = m.W
  for _, entry in ipairs(stored) do energy = energy + entry[2](m[entry[1]]) end
  expect(sol(energy, 2) - sol(energy, 0)):near(0, 1e-5)
end)

-- ── lines and shafts ───────────────────────────────────────────────────────────────────────────────────────

trials("masses with springs, dampers, stops and levers", "1 2 3 4", function()
  local n, items, energy, lost = 3 + random(10), {}, {}, 0
  local at = {}
  for k = 1, n do
    items["m" .. k] = l.mass{ m = number(), s0 = 2*k, v0 = number() - 1 }
    at[k], energy[#energy + 1] = { ("m%d.flange"):format(k) }, "m" .. k
  end
  for k = 1, 2*n do
    local a, b = k < n and k or random(n), k < n and k + 1 or random(n)
    if a ~= b then
      local name, kind = "c" .. k, random(3)
      local part = kind == 1 and l.spring{ k = number(), s0 = 2 } or kind == 2 and
        l.damper{ d = 0.2*number() }
        or l.stop{ k = 50, d = 0, s0 = -3 }
      if kind == 1 then energy[#energy + 1] = name end
      if kind == 2 then lost = lost + part.f*der(part.s) end
      if kind == 3 then lost = lost + part.f*der(part.s) end
      items[name] = part
      table.insert(at[a], name .. ".a")
      table.insert(at[b], name .. ".b")
    end
  end
  items.lever, items.end_mass = l.lever{ ratio = 2 }, l.mass{ m = 1 }
  energy[#energy + 1] = "end_mass"
  table.insert(at[1], "lever.a")
  items[#items + 1] = connect("lever.b", "end_mass.flange")
  for k = 1, n do items[#items + 1] = connect(table.unpack(at[k])) end
  items[#items + 1] = der(W) ~ lost
  local m = model(items)
  local low = m:reduce()
  local sol = low:integrate{ start = low:init{ fix = { W = 0 } }, to = 3, rtol = 1e-9, atol = 1e-10 }
  local total = m.W
  for _, name in ipairs(energy) do total = total + m[name].energy end
  expect(sol.status):equals "finished"
  expect(sol(total, 3) - sol(total, 0)):near(0, 1e-6)
end)

trials("shafts with gears, planetary gears, springs and dampers", "1 2 3 4", function()
  local n, items, energy, lost = 3 + random(7), {}, {}, 0
  local at = {}
  for k = 1, n do
    items["J" .. k] = r.inertia{ J = number(), phi0 = k == 1 and 0, w0 = k == 1 and 1 }
    at[k], energy[#energy + 1] = { ("J%d.flange"):format(k) }, "J" .. k
  end
  local start = { W = 0 }
  for k = 2, n do
    local name, kind, from = "g" .. k, random(3), random(k - 1)
    if kind == 1 then
      items[name] = r.gear{ ratio = number() }
      table.insert(at[from], name .. ".a")
      table.insert(at[k], name .. ".b")
    elseif kind == 2 then
      local part = r.spring{ c = number() }
      items[name], energy[#energy + 1] = part, name
      table.insert(at[from], name .. ".a")
      table.insert(at[k], name .. ".b")
    else
      local part = r.spring_damper{ c = number(), d = 0.1 }
      items[name] = part
      lost = lost + part.tau*der(part.phi)
      table.insert(at[from], name .. ".a")
      table.insert(at[k], name .. ".b")
    end
    if kind > 1 then start[("J%d.phi"):format(k)], start[("J%d.w"):format(k)] = 0.1*k, 0 end
  end
  items.plan, items.ring, items.carrier = r.planetary{ ratio = 2 }, r.inertia{ J = 2, phi0 = 0, w0 = 0.5 },
    r.inertia{}
  energy[#energy + 1], energy[#energy + 2] = "ring", "carrier"
  table.insert(at[1], "plan.sun")
  items[#items + 1] = connect("plan.ring", "ring.flange")
  items[#items + 1] = connect("plan.carrier", "carrier.flange")
  for k = 1, n do items[#items + 1] = connect(table.unpack(at[k])) end
  items[#items + 1] = der(W) ~ lost
  local m = model(items)
  local low = m:reduce()
  local sol = low:integrate{ start = low:init{ fix = start }, to = 3, rtol = 1e-9, atol = 1e-10 }
  local total = m.W
  for _, name in ipairs(energy) do total = total + m[name].energy end
  expect(sol(total, 3) - sol(total, 0)):near(0, 1e-6)
end)

-- ── multibody trees ────────────────────────────────────────────────────────────────────────────────────────

trials("trees of bodies in the plane", "1 2 3 4 5", function()
  local n, items, start, total = 2 + random(4), { w0 = p.fixed{} }, {}, nil
  local ends = { "w0.frame" }
  for k = 1, n do
    local from = one_of(ends)
    local B, R, J = ("B%d"):format(k), ("R%d"):format(k), ("J%d"):format(k)
    local kind = random(3)
    items[B] = p.body{ m = number(), J = number() }
    items[R] = p.rod{ dx = number(), dy = number() - 1 }
    items[J] = kind < 3 and p.revolute{ phi0 = random(), w0 = random() }
      or p.prismatic{ nx = 0.6, ny = 0.8, s0 = random(), v0 = random() }
    items[#items + 1] = connect(from, J .. ".a")
    items[#items + 1] = connect(J .. ".b", R .. ".a")
    items[#items + 1] = connect(R .. ".b", B .. ".frame")
    ends[#ends + 1] = B .. ".frame"
  end
  items.c = p.spring{ k = 5, s0 = 1 }
  items[#items + 1] = connect("w0.frame", "c.a")
  items[#items + 1] = connect(("B%d.frame"):format(n), "c.b")
  local m = model(items)
  total = m.c.energy
  for k = 1, n do total = total + m["B" .. k].energy end
  expect(m:dof()):equals(2*n)
  local low = m:dae():index() > 1 and m:reduce() or m      -- not every tree is an ODE after elimination
  local sol = low:integrate{ to = 1, rtol = 1e-9, atol = 1e-9 }
  expect(sol.status):equals "finished"
  expect(sol(total, 1) - sol(total, 0)):near(0, 1e-5)
end)

trials("trees of bodies in space", "1 2 3 4 5 6", function()
  local n, items, fix = 1 + random(2), { w0 = s3.fixed{} }, {}
  local ends, freedom = { "w0.frame" }, 0
  for k = 1, n do
    local B, R, J = ("B%d"):format(k), ("R%d"):format(k), ("J%d"):format(k)
    local kind = random(4)
    items[B] = s3.body{ m = number(), J = { number(), number(), number() } }
    items[R] = s3.rod{ d = { number(), number(), -number() } }
    items[J] = kind == 1 and s3.spherical{} or kind == 2 and s3.revolute{ axis = one_of { "x", "y", "z" } }
      or kind == 3 and s3.universal{} or s3.prismatic{ axis = one_of { "x", "z" } }
    freedom = freedom + 2*({ 3, 1, 2, 1 })[kind]
    items[#items + 1] = connect(one_of(ends), J .. ".a")
    items[#items + 1] = connect(J .. ".b", R .. ".a")
    items[#items + 1] = connect(R .. ".b", B .. ".frame")
    ends[#ends + 1] = B .. ".frame"
  end
  local m = model(items)
  expect(m:dof()):equals(freedom)
  local low, guess, total = m:reduce(), {}, 0
  for k = 1, n do
    guess[("B%d.q"):format(k)] = { 1, 0, 0, 0 }
    guess[("B%d.r"):format(k)] = { 1, 1, -1 }
    guess[("B%d.r'"):format(k)], guess[("B%d.q'"):format(k)] = { 0.3, 0.2, 0.1 }, { 0, 0.1, 0.2, 0.3 }
    total = total + m["B" .. k].energy
  end
  local sol = low:integrate{ start = low:init{ guess = guess }, to = 0.5, rtol = 1e-8, atol = 1e-9 }
  expect(sol.status):equals "finished"
  expect(sol(total, 0.5) - sol(total, 0)):near(0, 1e-5)
end)

-- ── heat, fluids, process units ────────────────────────────────────────────────────────────────────────────

trials("heat with radiation and sources", "1 2 3", function()
  local n, items, at, fed = 3 + random(12), {}, {}, 0
  for k = 1, n do
    items["C" .. k] = h.capacity{ C = number(), T0 = 280 + random(40) }
    at[k] = { ("C%d.port"):format(k) }
  end
  for k = 2, 2*n do
    local a, b = k <= n and k or random(n), k <= n and random(k - 1) or random(n)
    local name = "g" .. k
    items[name] = one_of { h.conductor{ G = number() }, h.resistor{ R = number() },
      h.radiation{ G = 0.1*number() } }
    table.insert(at[a], name .. ".a")
    table.insert(at[b], name .. ".b")
  end
  items.Q = h.heat_flow{ Q = 10*sin(t) }
  table.insert(at[1], "Q.port")
  for k = 1, n do items[#items + 1] = connect(table.unpack(at[k])) end
  local m = model(items)
  local total = 0
  for k = 1, n do total = total + m["C" .. k].energy end
  local sol = m:integrate{ to = 2, rtol = 1e-9 }
  expect(sol(total, 2) - sol(total, 0)):near(10*(1 - math.cos(2)), 1e-6)
end)

trials("fluid in tanks, elastic volumes, pipes, valves and pumps", "1 2 3 4", function()
  local n, items, at = 3 + random(10), {}, {}
  for k = 1, n do
    items["T" .. k] = k % 3 == 0 and w.accumulator{ C = 1e-4*number(), p0 = 1e3*number() }
      or w.tank{ A = number(), h0 = number() }
    at[k] = { ("T%d.port"):format(k) }
  end
  for k = 2, 2*n do
    local a, b = k <= n and k or random(n), k <= n and random(k - 1) or random(n)
    if a ~= b then
      local name = "x" .. k
      items[name] = one_of { w.pipe{ R = 1e5*number() }, w.inertance{ I = 1e5, q0 = 0 }, w.orifice{ A = 1e-3,
        dp0 = 10 },
        w.valve{ K = 1e-5, dp0 = 10 }, w.check_valve{ R = 1e5*number(), G = 1e-7 }, w.pump{ q = 1e-3*sin(t) },
        w.centrifugal_pump{ p0 = 1e6, qmax = 1e-2 } }
      table.insert(at[a], name .. ".a")
      table.insert(at[b], name .. ".b")
    end
  end
  for k = 1, n do items[#items + 1] = connect(table.unpack(at[k])) end
  local m = model(items)
  local volume, guess = 0, {}
  for k = 1, n do
    local T = m["T" .. k]
    volume = volume + (k % 3 == 0 and T.C*T.p or T.A*T.h)
  end
  for k = 2, 2*n do
    if items["x" .. k] and
      tostring(items["x" .. k]):find "centrifugal" then guess[("x%d.q"):format(k)] = 0.01 end
  end
  local sol = m:integrate{ start = m:init{ guess = guess }, to = 20, rtol = 1e-8 }
  expect(sol.status):equals "finished"
  expect(sol(volume, 20) - sol(volume, 0)):near(0, 1e-7)
end)

trials("rows of reactors and heat exchangers", "1 2 3", function()
  local n, items, feed, gone = 2 + random(8), {}, number(), 0
  local before
  for k = 1, n do
    local part = one_of { c.reactor{ V = number(), k0 = number() }, c.plug_flow{ V = number(), k0 = number(),
      cells = 3 } }
    items["R" .. k] = part
    items[#items + 1] = connect(("R%d.q"):format(k), 0.5)
    items[#items + 1] = connect(before and ("%s.c"):format(before) or 8, ("R%d.c_in"):format(k))
    before = "R" .. k
  end
  local m = model(items)
  -- what flows in is what flows out and what reacts, at rest: c = c_in Π 1/(1 + k V/q)
  local rest = 8
  for k = 1, n do
    local R = m["R" .. k]
    local plug = tostring(items["R" .. k]):find "plug" ~= nil
    local values = items["R" .. k]
    local V, k0 = evaluate(R.V, { [R.V] = R.V.value }), evaluate(R.k0, { [R.k0] = R.k0.value })
    rest = plug and rest/(1 + k0*V/(3*0.5))^3 or rest/(1 + k0*V/0.5)
  end
  local sol = m:integrate{ to = 200, rtol = 1e-9, atol = 1e-12 }
  expect(sol(m["R" .. n].c, 200)/rest):near(1, 1e-6)
  local fed = model { X = c.heat_exchanger{ UA = number(), cells = 1 + random(8), C1 = number(),
    C2 = number(), T0 = 300,
      counter = random(2) == 1 }, connect("X.w1", 0.7), connect("X.w2", 1.2), connect("X.T1_in", 350),
        connect("X.T2_in", 290),
    der(W) ~ 0.7*(350 - var "X.T1") + 1.2*(290 - var "X.T2"), start = { W = 0 } }
  local flow = fed:integrate{ to = 3, rtol = 1e-9 }
  expect(flow(fed.X.energy - fed.W, 3)):near(flow(fed.X.energy, 0), 1e-6)
end)

-- ── signals ────────────────────────────────────────────────────────────────────────────────────────────────

trials("chains of blocks have the product of their transfer functions", "1 2 3 4", function()
  local n, items, before = 3 + random(6), {}, input "u"
  local G = tf({ 1 }, { 1 })
  for k = 1, n do
    local kind, a, T = random(4), random(4), random(3)
    local x = "x" .. k
    if kind == 1 then items[x], G = s.gain{ k = a }, series(G, tf({ a }, { 1 }))
    elseif kind == 2 then items[x], G = s.first_order{ k = a, T = T }, series(G, tf({ a }, { T, 1 }))
    elseif kind == 3 then items[x], G = s.integrator{ k = a }, series(G, tf({ a }, { 1, 0 }))
    else items[x], G = s.filter{ w = a, D = T }, series(G, tf({ a^2 }, { 1, 2*T*a, a^2 })) end
    items[#items + 1] = connect(before, x .. ".u")
    before = x .. ".y"
  end
  local m = model(items)
  local H = m:tf(input "u", m["x" .. n].y)
  local function at(system, x)
    local function value(list)
      local sum = 0
      for k = 1, #list do sum = sum*x + evaluate(list[k], {}) end
      return sum
    end
    return value(system.num)/value(system.den)
  end
  for _, x in ipairs { 0.1, 1, 7 } do expect(at(H, x)/at(G, x)):near(1, 1e-9) end
end)
