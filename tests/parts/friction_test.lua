-- Clutches and dry friction whose side nobody says: it follows from the speeds. By hand: J w′ = tau.
local r, l = components.rotational, components.translational

-- J1 is driven by 1 N m, the clutch of 10 N m joins it with J2.
local function pair(u, mode0, w2, unit)
  unit = unit or 1
  local m = model { J1 = r.inertia{ phi0 = 0, w0 = 0 }, J2 = r.inertia{ phi0 = 0, w0 = unit*(w2 or 0) },
    T = r.torque{ tau = unit }, c = r.clutch{ tau0 = 10*unit, mode0 = mode0, rest = 1e-6*unit },
    connect("T.flange", "J1.flange", "c.a"), connect("c.b", "J2.flange"), connect("c.u", u) }
  local sol = m:integrate{ to = 2, rtol = 1e-8, atol = 1e-10*unit }
  return sol(m.J1.w, 2)/unit, sol(m.J2.w, 2)/unit
end

test("a clutch that closes later, and one that is closed from the start, whatever mode0 says", function()
  for _, unit in ipairs { 1, 1e3, 1e-4 } do
    for _, mode0 in ipairs { -1, 0, 1 } do
      for _, u in ipairs { ifelse(lt(t, 1), 0, 1), max(0, t - 1), t, t^2 } do
        local w1, w2 = pair(u, mode0, 0, unit)
        expect(w1):near(1, 1e-5)
        expect(w2):near(1, 1e-5)
      end
      local w1, w2 = pair(1, mode0, 3, unit)           -- J2 turns faster: both come to 5/2
      expect(w1):near(2.5, 1e-5)
      expect(w2):near(2.5, 1e-5)
    end
  end
end)

test("a mass that moves slides, without mode0", function()
  for _, v0 in ipairs { 4, -4 } do
    local m = model { m = l.mass{ s0 = 0, v0 = v0 }, R = l.friction{ F = 2 }, w = l.fixed{},
      connect("w.flange", "R.a"), connect("R.b", "m.flange") }
    local sol = m:integrate{ to = 5 }
    expect(sol(m.m.s, 5)):near(v0, 1e-6)
    expect(sol(m.m.v, 5)):near(0, 1e-8)
  end
end)

test("an amplifier at its limits inside a loop, and Newton's method where large terms leave a small x′",
  function()
  local e = components.electrical
  local function gate(a, b)
    return model { V = e.source{ v = 5 }, A = e.source{ v = a }, B = e.source{ v = b }, gnd = e.ground{},
      R = e.resistor{ R = 1e4 }, C = e.capacitor{ C = 1e-12, v0 = 5 }, N1 = e.mosfet{}, N2 = e.mosfet{},
      connect("V.p", "R.p"), connect("R.n", "N1.d", "C.p"), connect("N1.s", "N2.d"), connect("A.p", "N1.g"),
      connect("B.p", "N2.g"), connect("N2.s", "gnd.p", "V.n", "A.n", "B.n", "C.n") }
  end
  for _, row in ipairs { { 0, 0, 5 }, { 0, 5, 5 }, { 5, 0, 5 }, { 5, 5, 0.24526 } } do
    local m = gate(row[1], row[2])
    local sol = m:integrate{ to = 1e-6 }
    expect(sol.status):equals "finished"
    expect(sol(m.C.v, 1e-6)):near(row[3], 1e-4)
  end
  for _, gain in ipairs { 1e2, 1e4, 1e6 } do           -- Schmitt trigger's opposite: out = limit(2 v)
    local m = model { V = e.source{ v = 10*sin(t) }, A = e.opamp_limited{ A = gain, Vmax = 8, Vmin = -8 },
      R1 = e.resistor{}, R2 = e.resistor{}, gnd = e.ground{}, connect("V.p", "A.p"),
      connect("A.out", "R1.p"), connect("R1.n", "R2.p", "A.n"), connect("V.n", "R2.n", "gnd.p"),
      der(var "W") ~ var "A.out.v", start = { W = 0 } }
    local sol = m:integrate{ to = 2*math.pi, rtol = 1e-8 }
    expect(sol.status):equals "finished"
    expect(sol(m.A.out.v, math.pi/2)):near(8, 1e-12)
    expect(sol(m.A.out.v, 0.2)):near(20*math.sin(0.2)/(1 + 2/gain), 1e-9)
  end
end)
