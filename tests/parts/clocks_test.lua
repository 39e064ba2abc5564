-- Parts with clocks at one instant: outputs first, each after those it depends on, then the states behind.
local s, e = components.signals, components.electrical

-- The parts of make, made in this order.
local function made(order, make)
  local parts = {}
  for name in order:gmatch "%w+" do parts[name] = make[name]() end
  return parts
end

test("a chain of sampler, gain, discrete system, delay, controller in whatever order they are made", function()
  local make = { S = function() return s.sampler{ Ts = 0.1 } end, g = function() return s.gain{ k = 2 } end,
    G = function() return ss({ { 0.5 } }, { { 1 } }, { { 1 } }, { { 0.3 } }, 0.1) end,
    d = function() return s.unit_delay{ Ts = 0.1 } end,
    c = function() return s.discrete_pi{ Ts = 0.1, k = 0.7, Ti = 0.4 } end }
  local x, held, z, c, G, d = 0, 0, 0, nil, nil, nil
  for k = 0, 10 do
    local u = 2*(1 + 0.1*k)
    G = x + 0.3*u
    d, c = held, 0.7*(1 - held) + z
    x, held, z = 0.5*x + u, G, z + 0.7*0.1/0.4*(1 - held)
  end
  for _, order in ipairs { "S g G d c", "c d G g S", "G c S d g", "d S c G g" } do
    local items = made(order, make)
    for _, ends in ipairs { { 1 + t, "S.u" }, { "S.y", "g.u" }, { "g.y", "G.u" }, { "G.y", "d.u" },
      { 1, "c.r" }, { "d.y", "c.v" } } do items[#items + 1] = connect(table.unpack(ends)) end
    local m = model(items)
    local sol = m:integrate{ to = 1.05 }
    expect(sol(m.G.y, 1.05)):near(G, 1e-12)
    expect(sol(m.d.y, 1.05)):near(d, 1e-12)
    expect(sol(m.c.y, 1.05)):near(c, 1e-12)
  end
end)

test("a discrete system takes its input at the sample, and holds its output", function()
  local m = model { P = c2d(ss({ { -1 } }, { { 1 } }, { { 1 } }, { { 0 } }), 0.1), connect(t, "P.u") }
  local sol, x, a = m:integrate{ to = 1.05 }, 0, math.exp(-0.1)
  for k = 0, 9 do x = a*x + (1 - a)*k*0.1 end
  expect(sol(m.P.y, 1.05)):near(x, 1e-12)
  local gain = model { G = tf({ 3 }, { 1 }, 0.5), connect(t, "G.u") }
  expect(gain:integrate{ to = 1.3 }(gain.G.y, 1.3)):near(3, 1e-12)
end)

test("a sample that goes through a circuit to another sampler", function()
  local function sampler() return s.sampler{ Ts = 0.5 } end
  local make = { A = sampler, B = sampler }
  for _, order in ipairs { "A B", "B A" } do
    local items = made(order, make)
    items.V, items.R1, items.R2 = e.signal_source{}, e.resistor{ R = 1 }, e.resistor{ R = 3 }
    items.U, items.g = e.voltmeter{}, e.ground{}
    for _, ends in ipairs { { t, "A.u" }, { "A.y", "V.v" }, { "V.p", "R1.p" }, { "R1.n", "R2.p", "U.p" },
      { "V.n", "R2.n", "U.n", "g.p" }, { "U.v", "B.u" } } do
      items[#items + 1] = connect(table.unpack(ends))
    end
    local m = model(items)
    expect(m:integrate{ to = 1.2 }(m.B.y, 1.2)):near(0.75, 1e-12)
  end
end)

test("a loop without delay takes what was held", function()
  local m = model { S = s.sampler{ Ts = 1 }, connect(1 - var "S.y", "S.u") }
  local sol = m:integrate{ to = 3.5 }
  for k = 0, 3 do expect(sol(m.S.y, k + 0.5)):equals(k % 2 == 0 and 1 or 0) end
end)

test("clocks of two rates: the slow one sees what the fast one took at the same instant", function()
  for _, order in ipairs { "A B", "B A" } do
    local items = made(order, { A = function() return s.sampler{ Ts = 0.25 } end,
      B = function() return s.sampler{ Ts = 0.5 } end })
    items[1], items[2] = connect(t, "A.u"), connect("A.y", "B.u")
    local m = model(items)
    local sol = m:integrate{ to = 2 }
    expect(sol(m.A.y, 1.9)):near(1.75, 1e-12)
    expect(sol(m.B.y, 1.9)):near(1.5, 1e-12)
  end
end)
