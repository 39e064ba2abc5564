-- What a model of parts costs beside the same equations written by hand: processor time of runs in pairs, and
-- of preparing 10^3 … 10^4 parts. pendula bench/parts.lua [pairs]
local e, l, r = components.electrical, components.translational, components.rotational
local h, w, p = components.thermal, components.hydraulic, components.planar
local pairs_of_runs = tonumber(arg and arg[1]) or 21

local function seconds(sys, options)
  local before = os.clock()
  sys:integrate(options)
  return os.clock() - before
end

-- The median over pairs: what else the machine does slows both of a pair.
local function compare(name, parts, hand, options, start, own_start)
  local by_hand, ours = { start = start }, { start = own_start }
  for key, value in pairs(options) do by_hand[key], ours[key] = value, value end
  seconds(parts, ours)
  seconds(hand, by_hand)
  local ratios = {}
  for k = 1, pairs_of_runs do
    local first = k % 2 == 0 and seconds(parts, ours)
    local other = seconds(hand, by_hand)
    ratios[k] = (first or seconds(parts, ours))/other
  end
  table.sort(ratios)
  print(("%-14s %.2f"):format(name, ratios[(pairs_of_runs + 1)//2]))
end

local function ladder(n)
  local R, C, list, low = {}, {}, { connect("V.p", "R[1].p") }, { "V.n", "gnd.p" }
  for k = 1, n do
    R[k], C[k] = e.resistor{ R = 1.5 }, e.capacitor{ C = 0.7, v0 = 0 }
    list[#list + 1] = connect(("R[%d].n"):format(k), ("C[%d].p"):format(k))
    if k < n then list[#list + 1] = connect(("C[%d].p"):format(k), ("R[%d].p"):format(k + 1)) end
    low[#low + 1] = ("C[%d].n"):format(k)
  end
  list[#list + 1] = connect(table.unpack(low))
  return model { V = e.source{ v = sin(t) }, R = R, C = C, gnd = e.ground{}, list }
end

do
  local n, equations, zero = 40, {}, {}
  local v = var("v", n)
  for k = 1, n do
    local into = ((k == 1 and sin(t) or v[k - 1]) - v[k])/1.5
    equations[k], zero[k] = 0.7*der(v[k]) ~ (k < n and into - (v[k] - v[k + 1])/1.5 or into), 0
  end
  compare("RC ladder", ladder(n), dae(equations), { to = 100, rtol = 1e-6 }, { [v] = zero })
end

do
  local mb, mw, ks, kt = 300, 40, 1.5e4, 1.6e5
  local car = model { body = l.mass{ m = mb, s0 = -0.2, v0 = 0 }, wheel = l.mass{ m = mw, s0 = 0, v0 = 0 },
    G1 = l.force{ f = -9.81*mb }, G2 = l.force{ f = -9.81*mw }, strut = l.spring_damper{ k = ks, d = 1200 },
    bump = l.stop{ k = 2e5, d = 10, s0 = -0.25 }, tyre = l.stop{ k = kt, d = 10 },
    road = l.position{ s = 0.1 }, connect("wheel.flange", "strut.a", "bump.a", "tyre.b", "G2.flange"),
    connect("body.flange", "strut.b", "bump.b", "G1.flange"), connect("road.flange", "tyre.a") }
  local zb, zw, vb, vw = vars "zb zw vb vw"
  local s, v = zb - zw, vb - vw
  local strut = ks*s + 1200*v + ifelse(lt(s, -0.25), min(0, 2e5*(s + 0.25) + 10*v), 0)
  local tyre = ifelse(lt(zw, 0.1), min(0, kt*(zw - 0.1) + 10*vw), 0)
  compare("quarter car", car, dae { der(zb) ~ vb, der(zw) ~ vw, mb*der(vb) ~ -9.81*mb - strut,
    mw*der(vw) ~ strut - tyre - 9.81*mw }, { to = 3, rtol = 1e-9, atol = 1e-11 },
    { zb = -0.2, zw = 0, vb = 0, vw = 0 })
end

do
  local function slope(v) return -0.409091*v - 0.348485/2*(abs(v + 1) - abs(v - 1)) end
  local diode = component("chua_diode", { Ga = -0.757576, Gb = -0.409091 }, function(self)
    self.p, self.n = e.pin, e.pin
    local v, i = self:vars "v i"
    return { v ~ self.p.v - self.n.v, i ~ self.p.i, 0 ~ self.p.i + self.n.i,
      i ~ self.Gb*v + (self.Ga - self.Gb)/2*(abs(v + 1) - abs(v - 1)) }
  end)
  local circuit = model { L = e.inductor{ L = 18, i0 = 0 }, Ro = e.resistor{ R = 12.5e-3 },
    G = e.conductor{ G = 0.565 }, C1 = e.capacitor{ C = 10, v0 = 4 }, C2 = e.capacitor{ C = 100, v0 = 0 },
    N = diode{}, gnd = e.ground{}, connect("L.n", "Ro.p"), connect("L.p", "C2.p", "G.p"),
    connect("G.n", "C1.p", "N.p"), connect("Ro.n", "C2.n", "C1.n", "N.n", "gnd.p") }
  local v1, v2, i = vars "v1 v2 i"
  compare("Chua", circuit, dae { 10*der(v1) ~ 0.565*(v2 - v1) - slope(v1),
    100*der(v2) ~ 0.565*(v1 - v2) - i, 18*der(i) ~ v2 - 12.5e-3*i }, { to = 5000, rtol = 1e-7 },
    { v1 = 4, v2 = 0, i = 0 })
end

do
  local c2, c4 = 0.2638, 0.83654
  local L, C = e.inductor, e.capacitor
  local filter = model { V = e.source{ v = sin(t) }, R1 = e.resistor{}, R2 = e.resistor{}, gnd = e.ground{},
    C1 = C{ C = 1.072, v0 = 0 }, C2 = C{ C = c2 }, L1 = L{ L = 1.304, i0 = 0 }, C3 = C{ C = 1.682, v0 = 0 },
    C4 = C{ C = c4 }, L2 = L{ L = 0.8586, i0 = 0 }, C5 = C{ C = 0.7262, v0 = 0 }, connect("V.p", "R1.p"),
    connect("R1.n", "C1.p", "C2.p", "L1.p"), connect("C2.n", "L1.n", "C3.p", "C4.p", "L2.p"),
    connect("C4.n", "L2.n", "C5.p", "R2.p"), connect("V.n", "C1.n", "C3.n", "C5.n", "R2.n", "gnd.p") }
  local v1, v3, v5, i1, i2 = vars "v1 v3 v5 i1 i2"
  compare("Cauer filter", filter, dae { 1.072*der(v1) + c2*(der(v1) - der(v3)) ~ sin(t) - v1 - i1,
    1.682*der(v3) ~ c2*(der(v1) - der(v3)) + i1 - c4*(der(v3) - der(v5)) - i2,
    0.7262*der(v5) ~ c4*(der(v3) - der(v5)) + i2 - v5, 1.304*der(i1) ~ v1 - v3, 0.8586*der(i2) ~ v3 - v5 },
    { to = 2000, rtol = 1e-6 }, { v1 = 0, v3 = 0, v5 = 0, i1 = 0, i2 = 0 })
end

do
  local engine = model { A = p.fixed{}, jA = p.revolute{ phi0 = math.pi/4, w0 = 10 }, crank = p.rod{ dx = 1 },
    disc = p.body{ g = 0 }, jB = p.revolute{}, rod = p.rod{ dx = 2 }, jC = p.revolute{},
    piston = p.body{ g = 0 }, slide = p.prismatic{ nx = 1 }, connect("A.frame", "jA.a", "slide.a"),
    connect("jA.b", "disc.frame", "crank.a"), connect("crank.b", "jB.a"), connect("jB.b", "rod.a"),
    connect("rod.b", "jC.a"), connect("jC.b", "slide.b", "piston.frame") }:reduce()
  local a, b, s = vars "a b s"
  local hand = lagrange { q = { a, b, s }, T = a.dot^2/2 + s.dot^2/2, V = 0*a,
    C = { cos(a) + 2*cos(b) - s, sin(a) + 2*sin(b) } }:reduce()
  compare("slider crank", engine, hand, { to = 10, rtol = 1e-7 },
    hand:init{ fix = { a = math.pi/4, ["a'"] = 10 }, guess = { b = -0.3, s = 2.6 } },
    engine:init{ guess = { ["jB.phi"] = -1.1, ["slide.s"] = 2.6 } })
end

do
  local train = model { M = r.inertia{ J = 0.5, phi0 = 0, w0 = 10 }, c1 = r.spring_damper{ c = 100, d = 0.1 },
    g = r.gear{ ratio = 3 }, G = r.inertia{ J = 0.1, phi0 = 0, w0 = 10 }, T = r.torque{ tau = 5*sin(2*t) },
    c2 = r.spring_damper{ c = 50, d = 0.2 }, L = r.inertia{ J = 2, phi0 = 0, w0 = 0 },
    connect("T.flange", "M.flange", "c1.a"), connect("c1.b", "G.flange", "g.a"), connect("g.b", "c2.a"),
    connect("c2.b", "L.flange") }
  local p1, p2, p3, w1, w2, w3 = vars "p1 p2 p3 w1 w2 w3"
  local t1, t2 = 100*(p2 - p1) + 0.1*(w2 - w1), 50*(p3 - p2/3) + 0.2*(w3 - w2/3)
  compare("drive train", train, dae { der(p1) ~ w1, der(p2) ~ w2, der(p3) ~ w3,
    0.5*der(w1) ~ 5*sin(2*t) + t1, 0.1*der(w2) ~ t2/3 - t1, 2*der(w3) ~ -t2 }, { to = 50, rtol = 1e-7 },
    { p1 = 0, p2 = 0, p3 = 0, w1 = 10, w2 = 10, w3 = 0 })
end

do
  local feed = 3e-5*(1 + sin(t/100)/2)
  local plant = model { pump = w.pump{ q = feed }, air = w.ambient{}, drain = w.ambient{},
    T1 = w.tank{ A = 0.0154, h0 = 0.4 }, T2 = w.tank{ A = 0.0154, h0 = 0.2 },
    T3 = w.tank{ A = 0.0154, h0 = 0.3 }, v13 = w.orifice{ A = 5e-5, Cd = 0.5 },
    v32 = w.orifice{ A = 5e-5, Cd = 0.5 }, v20 = w.orifice{ A = 5e-5, Cd = 0.6 },
    connect("air.port", "pump.a"), connect("pump.b", "T1.port", "v13.a"),
    connect("v13.b", "T3.port", "v32.a"), connect("v32.b", "T2.port", "v20.a"),
    connect("v20.b", "drain.port") }
  local h1, h2, h3 = vars "h1 h2 h3"
  local function flow(Cd, dp) return Cd*5e-5*sqrt(2/1000)*dp/(dp^2 + 1)^(1/4) end
  local q13, q32, q20 = flow(0.5, 9810*(h1 - h3)), flow(0.5, 9810*(h3 - h2)), flow(0.6, 9810*h2)
  compare("three tanks", plant, dae { 0.0154*der(h1) ~ feed - q13, 0.0154*der(h3) ~ q13 - q32,
    0.0154*der(h2) ~ q32 - q20 }, { to = 40000, rtol = 1e-8 }, { h1 = 0.4, h2 = 0.2, h3 = 0.3 })
end

local function rod(n)
  local cells, walls, list = {}, {}, { connect("cold.port", "wall[1].a") }
  for k = 1, n do
    cells[k], walls[k] = h.capacity{ C = 1/n, T0 = 1 }, h.conductor{ G = k == 1 and 2*n or n }
    list[#list + 1] = connect(("wall[%d].b"):format(k), ("cell[%d].port"):format(k))
    if k < n then list[#list + 1] = connect(("wall[%d].b"):format(k), ("wall[%d].a"):format(k + 1)) end
  end
  return model { cell = cells, wall = walls, cold = h.temperature{ T = 0 }, list }
end

do
  local n, equations, one = 80, {}, {}
  local T = var("T", n)
  for k = 1, n do
    local into = k == 1 and -2*n*T[1] or n*(T[k - 1] - T[k])
    equations[k], one[k] = der(T[k])/n ~ (k < n and into + n*(T[k + 1] - T[k]) or into), 1
  end
  compare("heat rod", rod(n), dae(equations), { to = 0.5, rtol = 1e-8 }, { [T] = one })
end

for name, make in pairs { ladder = ladder, rod = rod } do
  for _, n in ipairs { 1000, 3000, 10000 } do
    collectgarbage()
    local before = os.clock()
    make(n//2):dae()
    print(("%-14s of %5d parts: prepared in %.2f s"):format(name, n, os.clock() - before))
  end
end
