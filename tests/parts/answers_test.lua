-- Models whose answer a formula of its own gives, in two systems of units where that is a question.
local e, l, r = components.electrical, components.translational, components.rotational
local w, p, s3 = components.hydraulic, components.planar, components.spatial

test("500 resistors and capacitors: the delay of Elmore, R C n (n + 1)/2", function()
  for _, unit in ipairs { { 1, 1 }, { 1e3, 1e-9 } } do
    local n, R, C = 500, {}, {}
    local list, low = { connect("V.p", "R[1].p") }, { "V.n", "g.p" }
    for k = 1, n do
      R[k], C[k] = e.resistor{ R = unit[1] }, e.capacitor{ C = unit[2], v0 = 0 }
      list[#list + 1] = connect(("R[%d].n"):format(k), ("C[%d].p"):format(k))
      if k < n then list[#list + 1] = connect(("C[%d].p"):format(k), ("R[%d].p"):format(k + 1)) end
      low[#low + 1] = ("C[%d].n"):format(k)
    end
    list[#list + 1] = connect(table.unpack(low))
    local m = model { V = e.source{ v = 1 }, R = R, C = C, g = e.ground{}, list,
      der(var "A") ~ 1 - var "C[500].v", start = { A = 0 } }
    local delay = unit[1]*unit[2]*n*(n + 1)/2
    local sol = m:integrate{ to = 30*delay, rtol = 1e-8, atol = 1e-10 }       -- e^-37 of the step is left
    expect(sol(m.A, 30*delay)/delay):near(1, 1e-6)
  end
end)

test("50 masses and 51 springs: the first mode, 2 √(k/m) sin(π/102)", function()
  for _, unit in ipairs { { 2, 5 }, { 2e-3, 5e-9 }, { 2e6, 5e3 } } do
    local n, mass, spring, angle = 50, {}, {}, math.pi/51
    for k = 1, n do mass[k] = l.mass{ m = unit[1], s0 = k + 0.1*math.sin(k*angle), v0 = 0 } end
    local list = { connect("A.flange", "c[1].a") }
    for k = 1, n + 1 do spring[k] = l.spring{ k = unit[2], s0 = 1 } end
    for k = 1, n do
      list[#list + 1] = connect(("c[%d].b"):format(k), ("m[%d].flange"):format(k), ("c[%d].a"):format(k + 1))
    end
    list[#list + 1] = connect("c[51].b", "B.flange")
    local x = model { A = l.fixed{}, B = l.fixed{ s0 = n + 1 }, m = mass, c = spring, list }
    local period = math.pi/(math.sqrt(unit[2]/unit[1])*math.sin(angle/2))
    local sol = x:integrate{ to = period, rtol = 1e-9, atol = 1e-12 }
    expect(sol(x.m[25].s, period)):near(25 + 0.1*math.sin(25*angle), 1e-7)
    expect(sol(x.m[25].s, period/4)):near(25, 1e-7)
  end
end)

test("a train of six gears: inertias over the squares of the ratios", function()
  local items = { T = r.torque{ tau = 3 }, J0 = r.inertia{ J = 0.01, phi0 = 0, w0 = 0 } }
  local before, ratio, J = { "T.flange", "J0.flange" }, 1, 0.01
  for k = 1, 6 do
    local own = -(1 + 0.5*k)
    ratio = ratio*own
    J = J + 0.1*k/ratio^2
    items["g" .. k], items["J" .. k] = r.gear{ ratio = own }, r.inertia{ J = 0.1*k }
    before[#before + 1] = ("g%d.a"):format(k)
    items[#items + 1] = connect(table.unpack(before))
    before = { ("g%d.b"):format(k), ("J%d.flange"):format(k) }
  end
  items[#items + 1] = connect(table.unpack(before))
  local m = model(items)
  local sol = m:integrate{ to = 2 }
  expect(sol(m.J0.w, 2)):near(6/J, 1e-8)
  expect(sol(m.J6.w, 2)):near(6/J/ratio, 1e-9)
end)

test("a three-phase bridge: 3 √3/π of the amplitude on average", function()
  local items, star, top, low = { g = e.ground{}, load = e.resistor{ R = 100 } }, { "g.p" }, { "load.p" },
    { "load.n" }
  for k = 1, 3 do
    items["V" .. k] = e.source{ v = 325*sin(100*pi*t - (k - 1)*2*pi/3) }
    items["U" .. k], items["D" .. k] = e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 },
      e.ideal_diode{ Ron = 1e-3, Goff = 1e-6 }
    items[#items + 1] = connect(("V%d.p"):format(k), ("U%d.p"):format(k), ("D%d.n"):format(k))
    star[#star + 1] = ("V%d.n"):format(k)
    top[#top + 1], low[#low + 1] = ("U%d.n"):format(k), ("D%d.p"):format(k)
  end
  for _, ends in ipairs { star, top, low } do items[#items + 1] = connect(table.unpack(ends)) end
  items[#items + 1], items.start = der(var "A") ~ var "load.v", { A = 0 }
  local m = model(items)
  local sol = m:integrate{ to = 0.04, rtol = 1e-7 }
  local mean = (sol(m.A, 0.04) - sol(m.A, 0.02))/0.02
  expect(mean/(3*math.sqrt(3)/math.pi*325)):near(1, 5e-5)              -- 2 Ron/R is 2e-5
end)

test("two centrifugal pumps side by side give twice the flow of one at its pressure", function()
  local function pump() return w.centrifugal_pump{ p0 = 1e5, qmax = 1e-3 } end
  local m = model { A = w.ambient{}, P1 = pump(), P2 = pump(), R = w.pipe{ R = 1e8 }, B = w.ambient{},
    connect("A.port", "P1.a", "P2.a"), connect("P1.b", "P2.b", "R.a"), connect("R.b", "B.port") }
  expect(m:init{}(m.R.q)/1e-3):near(2*(math.sqrt(2) - 1), 1e-9)       -- 1 - x² = 2 x
end)

test("a slider in a slot, driven evenly: its torque, m r² w² sin w t cos w t", function()
  local m = model { w = p.fixed{}, j = p.revolute{}, S = r.speed{ w = 3 }, crank = p.rod{ dx = 0.5 },
    slot = p.prismatic{ nx = 0, ny = 1 }, guide = p.prismatic{}, B = p.body{ m = 2, g = 0 },
    pin = p.revolute{},
    connect("S.flange", "j.axis"), connect("w.frame", "j.a", "guide.a"), connect("j.b", "crank.a"),
    connect("crank.b", "pin.a"), connect("pin.b", "slot.b"), connect("slot.a", "guide.b", "B.frame") }
  local low = m:reduce()
  local at = low:init{ guess = { ["guide.s"] = 0.5, ["slot.s"] = 0, ["pin.phi"] = 0 } }
  local sol = low:integrate{ start = at, to = 1, rtol = 1e-9, atol = 1e-10 }
  expect(sol(m.B.x, 1)):near(0.5*math.cos(3), 1e-7)
  expect(sol(m.S.flange.tau, 1)):near(-2*0.25*9*math.sin(3)*math.cos(3), 1e-6)
end)

-- Held by three drives at given angles: what gravity asks of them, by the arms of the weights.
test("three axes of an arm that are held: the moments of the weights behind them", function()
  local angle, items, before = { 0.4, -0.7, 0.3 }, { w = s3.fixed{} }, "w.frame"
  local guess, place, turn = {}, { 0, 0 }, 0
  local x = {}
  for k = 1, 3 do
    turn = turn + angle[k]
    x[k] = { at = place[1] }
    place = { place[1] + 0.5*math.cos(turn), place[2] - 0.5*math.sin(turn) }    -- y turns z into x
    x[k].body = place[1]
    items["j" .. k], items["D" .. k] = s3.revolute{ axis = "y" }, s3.drive{ axis = "y" }
    items["h" .. k], items["R" .. k] = r.angle{ phi = angle[k] }, s3.rod{ d = { 0.5, 0, 0 } }
    items["B" .. k] = s3.body{ m = k }
    items[#items + 1] = connect(before, ("j%d.a"):format(k), ("D%d.a"):format(k))
    items[#items + 1] = connect(("j%d.b"):format(k), ("D%d.b"):format(k), ("R%d.a"):format(k))
    items[#items + 1] = connect(("h%d.flange"):format(k), ("D%d.flange"):format(k))
    before = ("B%d.frame"):format(k)
    items[#items + 1] = connect(("R%d.b"):format(k), before)
    guess[("B%d.q"):format(k)] = { math.cos(turn/2), 0, math.sin(turn/2), 0 }
    guess[("B%d.r"):format(k)] = { place[1], 0, place[2] }
  end
  local m = model(items)
  expect(m:dof()):equals(0)
  local at = m:reduce():init{ guess = guess }
  for k = 1, 3 do
    local moment = 0
    for i = k, 3 do moment = moment + i*9.81*(x[i].body - x[k].at) end
    expect(at(m["D" .. k].flange.tau)):near(-moment, 1e-6)
  end
end)
