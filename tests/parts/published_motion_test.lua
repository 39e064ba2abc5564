-- Published positions, motions and temperatures, recomputed from parts.
local p, r, h = components.planar, components.rotational, components.thermal

test("Andrews' squeezer from seven bodies, Test Set for IVP Solvers (Mazzia & Magherini, 2008)", function()
  local function rod(dx, dy) return p.rod{ dx = dx, dy = dy } end
  local function body(m, J) return p.body{ m = m, J = J, g = 0 } end
  local parts = { O = p.fixed{}, A = p.fixed{ x = -0.06934, y = -0.00227 },
    B = p.fixed{ x = -0.03635, y = 0.03273 }, C = p.fixed{ x = 0.014, y = 0.072 },
    T = r.torque{ tau = 0.033 }, beta = p.revolute{ phi0 = -0.0617138900142764, w0 = 0 },
    spring = p.spring{ k = 4530, s0 = 0.07785 } }
  local function join(...) parts[#parts + 1] = connect(...) end
  for _, name in ipairs { "theta", "gamma", "phi", "delta", "omega", "epsilon", "F4", "F6", "F3" } do
    parts[name] = p.revolute{}
  end
  -- name, mass, inertia, where it hangs, its centre of mass and its points
  for _, b in ipairs { { "K1", 0.04325, 2.194e-6, "beta.b", { 0.00092, 0 }, { 0.007, 0 } },
    { "K2", 0.00365, 4.410e-7, "theta.b", { -0.0115, 0 }, { -0.028, 0 } },
    { "K3", 0.02373, 5.255e-6, "gamma.b", { 0.01043, -0.01874 }, { 0, -0.035 }, { 0.02, -0.018 } },
    { "K5", 0.07050, 1.169e-5, "delta.b", { 0.02308, 0.00916 }, { 0.04, 0 } },
    { "K4", 0.00706, 5.667e-7, "phi.b", { 0, -0.00579 }, { 0, -0.02 } },
    { "K7", 0.05498, 1.912e-5, "epsilon.b", { -0.00449, -0.01228 }, { 0, -0.04 } },
    { "K6", 0.00706, 5.667e-7, "omega.b", { 0.00579, 0 }, { 0.02, 0 } } } do
    local name = b[1]
    parts[name] = body(b[2], b[3])
    local frames = { b[4] }
    for k = 5, #b do
      parts[name .. "_" .. k - 5] = rod(b[k][1], b[k][2])
      frames[#frames + 1] = ("%s_%d.a"):format(name, k - 5)
    end
    join(table.unpack(frames))
    join(name .. "_0.b", name .. ".frame")
  end
  join("O.frame", "beta.a")
  join("beta.axis", "T.flange")
  join("K1_1.b", "theta.a")
  join("B.frame", "gamma.a")
  join("A.frame", "delta.a", "epsilon.a")
  join("K5_1.b", "phi.a")
  join("K7_1.b", "omega.a")
  join("K2_1.b", "F3.a", "F4.a", "F6.a")
  join("K3_1.b", "F3.b")
  join("K4_1.b", "F4.b")
  join("K6_1.b", "F6.b")
  join("K3_2.b", "spring.b")
  join("C.frame", "spring.a")
  local m = model(parts)
  expect(m:index()):equals(3)
  expect(m:dof()):equals(2)
  local low = m:reduce()
  local sol = low:integrate{ to = 0.03, rtol = 1e-9, atol = 1e-10, start = low:init{ guess = {
    ["theta.phi"] = 0, ["gamma.phi"] = 0.455, ["phi.phi"] = 0.223, ["delta.phi"] = 0.487,
    ["omega.phi"] = -0.223, ["epsilon.phi"] = 1.231 } } }
  for name, value in pairs { beta = 15.81077119629904, theta = -15.75637105984298,
    gamma = 0.04082224013073101, phi = -0.5347301163226948, delta = 0.5244099658805304,
    omega = 0.5347301163226948, epsilon = 1.048080741042263 } do
    expect(sol(m[name].phi, 0.03)):near(value, 1e-5)
  end
end)

local degree = math.pi/180

test("open and crossed four-bar linkage, Norton, Design of Machinery, example 4-1", function()
  local m = model { w = p.fixed{}, far = p.fixed{ x = 100 }, drive = r.angle{ phi = 40*degree },
    crank = p.revolute{}, a = p.rod{ dx = 40 }, pin = p.revolute{}, b = p.rod{ dx = 120 },
    knee = p.revolute{}, rocker = p.revolute{}, c = p.rod{ dx = 80 }, connect("crank.axis", "drive.flange"),
    connect("w.frame", "crank.a"), connect("crank.b", "a.a"), connect("a.b", "pin.a"),
    connect("pin.b", "b.a"), connect("b.b", "knee.a"), connect("far.frame", "rocker.a"),
    connect("rocker.b", "c.a"), connect("c.b", "knee.b") }
  for _, row in ipairs { { 20.298, 57.325 }, { -60.98, -98.01 } } do
    local at = m:init{ guess = { ["pin.phi"] = (row[1] - 40)*degree, ["rocker.phi"] = row[2]*degree,
      ["knee.phi"] = (row[2] - row[1])*degree } }
    expect(at(m.b.b.phi)/degree):near(row[1], 6e-3)
    expect(at(m.rocker.phi)/degree):near(row[2], 6e-3)
  end
end)

test("offset slider crank, Norton, Design of Machinery, example 4-2", function()
  local m = model { w = p.fixed{}, rail = p.fixed{ y = -20 }, drive = r.angle{ phi = 60*degree },
    crank = p.revolute{}, a = p.rod{ dx = 40 }, pin = p.revolute{}, b = p.rod{ dx = 120 },
    bolt = p.revolute{}, guide = p.prismatic{}, connect("crank.axis", "drive.flange"),
    connect("w.frame", "crank.a"), connect("crank.b", "a.a"), connect("a.b", "pin.a"),
    connect("pin.b", "b.a"), connect("b.b", "bolt.a"), connect("rail.frame", "guide.a"),
    connect("guide.b", "bolt.b") }
  local at = m:init{ guess = { ["pin.phi"] = -1.5, ["bolt.phi"] = 0.5, ["guide.s"] = 130 } }
  expect(at(m.guide.s)):near(126.84, 5e-3)
  expect(at(m.b.b.phi)/degree + 180):near(152.91, 5e-3)     -- counted from the bolt to the pin
end)

-- Half a plane wall of n cells; convection with h L/k = Bi. The rate of decay and what it begins with, in the
-- middle of the wall; the cells cost up to 1/(8 n²) of them.
local function wall(Bi, n)
  local list = { air = h.temperature{ T = 0 }, G = h.conductor{ G = 1/(1/Bi + 1/(2*n)) } }
  for k = 1, n do list["C" .. k] = h.capacity{ C = 1/n, T0 = 1 } end
  for k = 1, n - 1 do
    list["G" .. k] = h.conductor{ G = n }
    list[#list + 1] = connect("C" .. k .. ".port", "G" .. k .. ".a")
    list[#list + 1] = connect("G" .. k .. ".b", "C" .. k + 1 .. ".port")
  end
  list[#list + 1] = connect("C" .. n .. ".port", "G.a")
  list[#list + 1] = connect("G.b", "air.port")
  local m = model(list)
  local sol = m:integrate{ to = 2, rtol = 1e-9, atol = 1e-12 }
  local rate = math.log(sol(m.C1.T, 1)/sol(m.C1.T, 2))
  return math.sqrt(rate), sol(m.C1.T, 1)*math.exp(rate)
end

test("conduction in a plane wall, one term: Incropera & DeWitt, table 5.1", function()
  for _, row in ipairs { { 0.1, 0.3111, 1.0161 }, { 1, 0.8603, 1.1191 }, { 10, 1.4289, 1.2620 } } do
    local zeta, C1 = wall(row[1], 80)
    expect(zeta):near(row[2], 5e-5 + row[2]^3/(8*80^2))
    expect(C1):near(row[3], 5e-5 + row[2]^2/(4*80^2)*row[3])
  end
end)
