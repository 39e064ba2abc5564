-- Random networks of 3 to 50 parts: power balances at every moment (Tellegen), and energy over time.
local seed
local function random(n) return math.random(n) end

-- Parts a to b between nodes; the first n - 1 form a tree, so that everything is connected.
local function network(nodes, parts, make, ends)
  local items, at = {}, {}
  for k = 1, nodes do at[k] = {} end
  for k = 1, parts do
    local a = k < nodes and k + 1 or random(nodes)
    local b = k < nodes and random(k) or (a + random(nodes - 1) - 1) % nodes + 1
    if a == b then b = a % nodes + 1 end
    items["x" .. k] = make(k)
    table.insert(at[a], ("x%d.%s"):format(k, ends[1]))
    table.insert(at[b], ("x%d.%s"):format(k, ends[2]))
  end
  return items, at
end

local function power_of(part, across, through)
  return part[1][across]*part[1][through] + part[2][across]*part[2][through]
end

local e, h, w = components.electrical, components.thermal, components.hydraulic

local function random_circuit()
  local nodes = 2 + random(8)
  local parts = math.min(50, nodes + random(3*nodes))
  local kinds = {
    function() return e.resistor{ R = random(5) } end,
    function() return e.conductor{ G = random(5) } end,
    function() return e.capacitor{ C = random(4) } end,
    function() return e.inductor{ L = random(4) } end,
    function() return e.current{ i = random(3)*sin(random(3)*t) } end,
  }
  local items, at = network(nodes, parts,
    function(k) return kinds[k < nodes and random(2) or random(5)]() end, { "p", "n" })
  items.gnd = e.ground{}
  table.insert(at[1], "gnd.p")
  for k = 1, nodes do items[#items + 1] = connect(table.unpack(at[k])) end
  return model(items), parts
end

for trial = 1, 12 do
  seed = 100 + trial
  test(("circuit with seed %d: power and energy balance"):format(seed), function()
    math.randomseed(seed)
    local m, parts = random_circuit()
    local fix = {}
    local low = m:dae():index() > 1 and m:reduce() or m:dae()
    for _, x in ipairs { table.unpack((function()
      local list = {}
      for k = 1, #low.differential do list[k] = low.differential[k] end
      return list
    end)()) } do fix[x] = 0 end
    local at = low:init{ guess = fix }
    local sol = low:integrate{ start = at, to = 1, rtol = 1e-9, atol = 1e-11 }
    local total, stored, lost = 0, 0, 0
    for k = 1, parts do
      local x = m["x" .. k]
      total = total + power_of({ x.p, x.n }, "v", "i")
      local name = tostring(x):match "^%a+"
      if name == "capacitor" then stored = stored + x.C*x.v^2/2 end
      if name == "inductor" then stored = stored + x.L*x.i^2/2 end
      if name == "resistor" or name == "conductor" or name == "current" then
        lost = lost + x.p.v*x.p.i + x.n.v*x.n.i
      end
    end
    expect(sol(total, 0.7)):near(0, 1e-8)
    local n, sum = 400, 0                             -- Simpson's rule
    for k = 0, n do
      local weight = (k == 0 or k == n) and 1 or k % 2 == 1 and 4 or 2
      sum = sum + weight*(type(lost) == "number" and 0 or sol(lost, k/n))/(3*n)
    end
    local change = type(stored) == "number" and 0 or sol(stored, 1) - sol(stored, 0)
    expect(change + sum):near(0, 1e-6)
  end)
end

test("heat and volume are kept in random networks", function()
  math.randomseed(7)
  for _ = 1, 4 do
    local nodes = 3 + random(20)
    local items, at = network(nodes, math.min(50, 2*nodes),
      function() return h.conductor{ G = random(5) } end, { "a", "b" })
    local heat = 0
    for k = 1, nodes do
      items["c" .. k] = h.capacity{ C = random(5), T0 = random(100) }
      items[#items + 1] = connect("c" .. k .. ".port", table.unpack(at[k]))
    end
    local m = model(items)
    for k = 1, nodes do heat = heat + m["c" .. k].C*m["c" .. k].T end
    local sol = m:integrate{ to = 3, rtol = 1e-8 }
    expect(sol(heat, 3)):near(sol(heat, 0), 1e-7)
  end
  for _ = 1, 3 do
    local nodes = 3 + random(10)
    local items, at = network(nodes, 2*nodes, function() return w.orifice{ A = random(5)*1e-4 } end,
      { "a", "b" })
    local volume = 0
    for k = 1, nodes do
      items["T" .. k] = w.tank{ A = random(5), h0 = random(10) }
      items[#items + 1] = connect("T" .. k .. ".port", table.unpack(at[k]))
    end
    local m = model(items)
    for k = 1, nodes do volume = volume + m["T" .. k].volume end
    local sol = m:integrate{ to = 100, rtol = 1e-8 }
    expect(sol(volume, 100)):near(sol(volume, 0), 1e-7)
  end
end)

test("momentum and energy are kept in random lines of masses, springs and gears", function()
  local l, r = components.translational, components.rotational
  math.randomseed(11)
  for _ = 1, 4 do
    local n = 2 + random(12)
    local items, momentum, energy = {}, 0, 0
    for k = 1, n do
      items["m" .. k] = l.mass{ m = random(5), s0 = k, v0 = random(3) }
      if k > 1 then
        items["c" .. k] = l.spring{ k = random(9), s0 = 1 }
        items[#items + 1] = connect(("m%d.flange"):format(k - 1), ("c%d.a"):format(k))
        items[#items + 1] = connect(("c%d.b"):format(k), ("m%d.flange"):format(k))
      end
    end
    local x = model(items)
    for k = 1, n do
      momentum, energy = momentum + x["m" .. k].m*x["m" .. k].v, energy + x["m" .. k].energy
      if k > 1 then energy = energy + x["c" .. k].energy end
    end
    local sol = x:integrate{ to = 5, rtol = 1e-9, atol = 1e-10 }
    expect(sol(momentum, 5)):near(sol(momentum, 0), 1e-7)
    expect(sol(energy, 5)):near(sol(energy, 0), 1e-6)
  end
  local items, energy = {}, 0
  for k = 1, 5 do
    items["J" .. k] = r.inertia{ J = k, phi0 = k == 1 and 0, w0 = k == 1 and 1 }
    if k > 1 then
      items["g" .. k] = r.gear{ ratio = k }
      items[#items + 1] = connect(("J%d.flange"):format(k - 1), ("g%d.a"):format(k))
      items[#items + 1] = connect(("g%d.b"):format(k), ("J%d.flange"):format(k))
    end
  end
  local x = model(items)
  for k = 1, 5 do energy = energy + x["J" .. k].energy end
  local sol = x:integrate{ to = 1 }
  expect(x:dof()):equals(2)
  expect(sol(energy, 1)):near(sol(energy, 0), 1e-9)
end)
