-- Random systems of bodies with forces, dampers and wheels, and mixers: power in = energy stored + lost.
local p, s, c = components.planar, components.spatial, components.process
local random, W = math.random, var "W"
local function number() return 0.5 + random(8)/4 end

local function trials(title, count, body)
  for seed = 1, count do
    test(("%s, seed %d"):format(title, seed), function()
      math.randomseed(seed)
      body()
    end)
  end
end

local function balances(m, energy, low, start, to)
  local sol = low:integrate{ start = start, to = to, rtol = 1e-9, atol = 1e-10 }
  expect(sol.status):equals "finished"
  expect(sol(energy - m.W, to)):near(sol(energy - m.W, 0), 1e-6)
end

trials("rolling and flying bodies, springs with dampers, forces", 5, function()
  local n, items, power = 2 + random(4), { w0 = p.fixed{} }, 0
  for k = 1, n do
    local B, wheel = "B" .. k, random(2) == 1
    items[B] = p.body{ m = number(), J = number(), x0 = not wheel and 3*k, y0 = not wheel and number(),
      phi0 = not wheel and 0, vx0 = not wheel and 0, vy0 = not wheel and number(),
      w0 = not wheel and number() }
    if wheel then
      items[B] = p.body{ m = number(), J = number(), phi0 = 0, w0 = number() - 1 }
      items["R" .. k] = p.wheel{ r = number(), x0 = 3*k }
      items[#items + 1] = connect(B .. ".frame", ("R%d.frame"):format(k))
    end
    local fx, fy, tau = number()*sin(3*t), number()*cos(t), number()*sin(t)
    local F = p.force{ fx = fx, fy = fy, tau = tau }
    items["F" .. k] = F
    items[#items + 1] = connect(B .. ".frame", ("F%d.frame"):format(k))
    power = power + fx*der(F.frame.x) + fy*der(F.frame.y) + tau*der(F.frame.phi)
    local spring = p.spring{ k = number(), d = number(), s0 = 1 }
    items["c" .. k] = spring
    items[#items + 1] = connect(k == 1 and "w0.frame" or ("B%d.frame"):format(k - 1), ("c%d.a"):format(k))
    items[#items + 1] = connect(("c%d.b"):format(k), B .. ".frame")
    power = power - spring.d*der(spring.s)^2
  end
  items[#items + 1], items.start = der(W) ~ power, { W = 0 }
  local m = model(items)
  local low, energy = m:reduce(), 0
  for k = 1, n do energy = energy + m["B" .. k].energy + m["c" .. k].energy end
  balances(m, energy, low, low:init{}, 1)
end)

trials("welded bodies in space with springs, dampers and forces", 3, function()
  local n, items, power, guess = 1 + random(2), { w0 = s.fixed{} }, 0, {}
  for k = 1, n do
    local A, B = "A" .. k, "B" .. k
    items[A] = s.body{ m = number(), J = { number(), number(), number() }, r0 = { 2*k, 1, 0 },
      v0 = { 0, 0, 1 }, q0 = { 1, 0, 0, 0 }, w0 = { 0.3, 0.2, 0.1 } }
    items[B], items["j" .. k] = s.body{ m = number(), J = { 1, 2, 2 } }, s.weld{}
    guess[B .. ".q"], guess[B .. ".r"] = { 1, 0, 0, 0 }, { 2*k, 1, 0 }
    local f = { number()*sin(3*t), number()*cos(t), number() }
    local F, spring = s.force{ f = f }, s.spring{ k = number(), d = number(), s0 = 1 }
    items["F" .. k], items["c" .. k] = F, spring
    items[#items + 1] = connect(A .. ".frame", ("j%d.a"):format(k), ("F%d.frame"):format(k),
      ("c%d.b"):format(k))
    items[#items + 1] = connect(("j%d.b"):format(k), B .. ".frame")
    items[#items + 1] = connect(k == 1 and "w0.frame" or ("B%d.frame"):format(k - 1), ("c%d.a"):format(k))
    for i = 1, 3 do power = power + f[i]*der(F.frame.r[i]) end
    power = power - spring.d*der(spring.s)^2
  end
  items[#items + 1], items.start = der(W) ~ power, { W = 0 }
  local m = model(items)
  local low, energy = m:reduce(), 0
  for k = 1, n do energy = energy + m["A" .. k].energy + m["B" .. k].energy + m["c" .. k].energy end
  balances(m, energy, low, low:init{ guess = guess }, 0.5)
end)

trials("trees of mixers keep the flow and what it carries", 4, function()
  local items, streams, q, x = {}, {}, 0, 0
  for k = 1, 3 + random(20) do
    local flow, value = number(), 10*number()
    streams[k], q, x = { flow, value }, q + flow, x + flow*value
  end
  for k = 1, #streams - 1 do
    local M, a, b = "M" .. k, table.remove(streams, random(#streams)), table.remove(streams, random(#streams))
    items[M] = c.mixer{}
    for i, stream in ipairs { a, b } do
      items[#items + 1] = connect(stream[1], ("%s.q%d"):format(M, i))
      items[#items + 1] = connect(stream[2], ("%s.x%d"):format(M, i))
    end
    streams[#streams + 1] = { M .. ".q", M .. ".x" }
  end
  local last = streams[1][1]:match "%w+"
  local m = model(items)
  local at = m:init{}
  expect(at(m[last].q)):near(q, 1e-12)
  expect(at(m[last].q*m[last].x)):near(x, 1e-10)
end)

test("springs in series without a body between them, in the plane and in space: one spring, 1/k = 1/2 + 1/3", function()
  local s3 = components.spatial
  local flat = model { w = p.fixed{}, c1 = p.spring{ k = 2, s0 = 1 }, c2 = p.spring{ k = 3, s0 = 1 },
    B = p.body{ g = 0, x0 = 2.5, y0 = 0, phi0 = 0, vx0 = 0, vy0 = 0, w0 = 0 }, connect("w.frame", "c1.a"),
    connect("c1.b", "c2.a"), connect("c2.b", "B.frame") }
  local sol = flat:integrate{ to = 1, rtol = 1e-9, start = flat:init{ guess = { ["c1.b.x"] = 1.3 } } }
  local s = 2 + math.cos(math.sqrt(6/5))/2
  expect(sol(flat.B.x, 1)):near(s, 1e-7)
  expect(sol(flat.c1.b.phi, 1)):equals(0)
  local solid = model { w = s3.fixed{}, c1 = s3.spring{ k = 2, s0 = 1 }, c2 = s3.spring{ k = 3, s0 = 1 },
    B = s3.body{ g = 0, r0 = { 2.5, 0, 0 }, v0 = { 0, 0, 0 }, q0 = { 1, 0, 0, 0 }, w0 = { 0, 0, 0 } },
    connect("w.frame", "c1.a"), connect("c1.b", "c2.a"), connect("c2.b", "B.frame") }:reduce()
  sol = solid:integrate{ to = 1, rtol = 1e-9, start = solid:init{ guess = { ["c1.b.r1"] = 1.3 } } }
  expect(sol(var "B.r1", 1)):near(s, 1e-7)
end)

test("springs that meet inside a part with a connector of its own", function()
  local star = component("star", {}, function(self)
    self.p, self.c1, self.c2 = p.frame, p.spring{ k = 2 }, p.spring{ k = 2 }
    self.A, self.B = p.fixed{ x = -1 }, p.fixed{ x = 1 }
    return { connect(self.A.frame, self.c1.a), connect(self.B.frame, self.c2.a),
      connect(self.c1.b, self.c2.b, self.p) }
  end)
  local m = model { S = star{}, c3 = p.spring{ k = 4 }, F = p.fixed{ y = -1 }, connect("S.p", "c3.a"),
    connect("c3.b", "F.frame") }
  local at = m:init{ guess = { ["S.p.x"] = 0.1, ["S.p.y"] = -0.4 } }
  expect(at(m.S.p.y)):near(-0.5, 1e-9)                 -- 2 k₁ y = -k₃ (y + 1), whatever the length
  expect(at(m.S.p.x)):near(0, 1e-9)
end)
