-- Walls: impacts that end at rest, contact that ends, travel beyond what a part has.
local l, h = components.translational, components.hydraulic

local function between_walls(options, f)
  return model { m = l.mass_with_stops(options), F = l.force{ f = f }, connect("m.flange", "F.flange") }
end

test("a mass that is pressed to a wall stays there, whatever its restitution", function()
  for _, row in ipairs { { 0, 1 }, { 0.5, 40 }, { 0.8, 40 } } do
    local m = between_walls({ v0 = 1, e = row[1], smax = 0.5 }, 1)
    local sol = m:integrate{ to = row[2] }
    expect(sol.status):equals "finished"
    expect(sol(m.m.s, row[2])):near(0.5, 1e-6)
    expect(sol(m.m.v, row[2])):near(0, 1e-9)
    expect(sol(m.m.N, row[2])):near(-1, 1e-9)
  end
end)

test("a mass leaves the wall where the force changes sign", function()
  local m = between_walls({ v0 = 0, e = 0, s0 = 1 }, 1 - t)   -- held until t = 1, then s = 1 - (t - 1)³/6
  local sol = m:integrate{ to = 2, rtol = 1e-9 }
  expect(sol(m.m.s, 0.9)):near(1, 1e-12)
  expect(sol(m.m.s, 2)):near(1 - 1/6, 1e-8)
  expect(sol(m.m.v, 2)):near(-1/2, 1e-8)
end)

test("an event says which part it is of, in models inside models, too", function()
  local inner = between_walls({ v0 = 1, e = 0.5 }, 0)
  local sol = model { two = { inner, inner } }:integrate{ to = 1.5 }
  expect(#sol.events):equals(2)
  local parts = { [sol.events[1].part] = true, [sol.events[2].part] = true }
  expect(parts["two[1].m"] and parts["two[2].m"]):is_true()
  expect(tostring(sol.events[1].when):find("two[", 1, true) ~= nil):is_true()
  local x = var "x"                                    -- an event of a run of equations is of no part
  local plain = dae { der(x) ~ 1 }:integrate{ start = { x = 0 }, to = 2, events = { { when = x - 1 } } }
  expect(plain.events[1].part):equals(nil)
  expect(tostring(plain.events[1].when)):equals "x - 1"
end)

test("a ball's bounces to its rest: v0/g + 2 e v/(g (1 - e)) in all", function()
  local m = between_walls({ smin = 0, smax = 10, s0 = 1, e = 0.5, rest = 1e-6 }, -2)   -- falls 1 s, v = 2
  local sol = m:integrate{ to = 4, rtol = 1e-9 }
  expect(sol(m.m.wall, 2.99)):equals(0)
  expect(sol(m.m.wall, 3.01)):equals(-1)
  expect(sol(m.m.s, 4)):near(0, 1e-9)
end)

test("what two walls cannot mean", function()
  local function refused(options, pattern)
    expect(function() between_walls(options, 0):init{} end):fails(pattern)
  end
  refused({ e = 1.5 }, "e = 1.5 must not be outside 0 … 1")
  refused({ s0 = 3 }, "s0 = 3 must not be outside -1 … 1")
  refused({ s0 = 1, v0 = 2 }, "v0 = 2 leads into the wall at s0 = smax")
end)

test("a cylinder ends its run beyond its stroke", function()
  local m = model { P = h.ambient{ p = 5e5 }, T = h.ambient{}, m = l.mass{ m = 10, s0 = 0, v0 = 0 },
    C = h.cylinder{ A = 2e-3, pa0 = 5e5, stroke = 0.1 }, connect("P.port", "C.a"), connect("T.port", "C.b"),
    connect("C.rod", "m.flange") }
  local sol = m:integrate{ to = 2, rtol = 1e-9 }
  expect(sol.status):equals "event"                    -- 1000 N move 10 kg: s = 50 t²
  expect(sol.events[1].t):near(math.sqrt(0.1005/50), 1e-7)
  expect(sol.events[1].part):equals "C"
  expect(tostring(sol):find(", event of C\n", 1, true) ~= nil):is_true()
end)
