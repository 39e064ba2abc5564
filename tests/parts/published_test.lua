-- Examples of other tools with the values they publish: the reference trajectories of the FMI cross checks
-- (Modelica Association, fmi-cross-check; Modelica Standard Library 3.2) and of Modia's tests.
local e, l, r = components.electrical, components.translational, components.rotational
local h, s = components.thermal, components.signals

test("Cauer low-pass filter, Modelica.Electrical.Analog.Examples.CauerLowPassAnalog, at 60 s", function()
  local L, C = e.inductor, e.capacitor
  local m = model {
    V = e.source{ v = ifelse(lt(t, 1), 0, 1) }, R1 = e.resistor{}, R2 = e.resistor{}, gnd = e.ground{},
    C1 = C{ C = 1.072, v0 = 0 }, C2 = C{ C = 1/(1.704992^2*1.304) }, L1 = L{ L = 1.304, i0 = 0 },
    C3 = C{ C = 1.682, v0 = 0 }, C4 = C{ C = 1/(1.179945^2*0.8586) }, L2 = L{ L = 0.8586, i0 = 0 },
    C5 = C{ C = 0.7262, v0 = 0 }, connect("V.p", "R1.p"), connect("R1.n", "C1.p", "C2.p", "L1.p"),
    connect("C2.n", "L1.n", "C3.p", "C4.p", "L2.p"), connect("C4.n", "L2.n", "C5.p", "R2.p"),
    connect("V.n", "C1.n", "C3.n", "C5.n", "R2.n", "gnd.p") }
  local sol = m:reduce():integrate{ to = 60, rtol = 1e-9, atol = 1e-10 }
  for _, pair in ipairs { { m.C1.v, 0.499705815834 }, { m.C3.v, 0.501107506238 }, { m.C5.v, 0.499705606556 },
    { m.L1.i, 0.499365217755 }, { m.L2.i, 0.50096432133 } } do
    expect(sol(pair[1], 60)):near(pair[2], 5e-7)
  end
end)

local step = component("step", { at = 1 }, function(self)
  local y = self:discrete("y", 0)
  self:gives(y)
  self:event{ when = t - self.at, direction = 1, reset = { [y] = 1 } }
end)

test("three clutches that stick and slip, Modelica.Mechanics.Rotational.Examples.CoupledClutches", function()
  local function clutch(mode0) return r.clutch{ tau0 = 10, peak = 1.1, mode0 = mode0 } end
  local m = model {
    J1 = r.inertia{ J = 1, phi0 = 0, w0 = 10 }, J2 = r.inertia{ J = 1, phi0 = 0, w0 = 0 },
    J3 = r.inertia{ J = 1, phi0 = 0, w0 = 0 }, J4 = r.inertia{ J = 1, phi0 = 0, w0 = 0 },
    T = r.torque{ tau = 10*sin(2*pi*5*t) }, c1 = clutch(-1), c2 = clutch(-1), c3 = clutch(-1),
    s2 = step{ at = 0.4 }, s3 = step{ at = 0.9 }, connect("c1.u", cos(2*pi*0.2*t)), connect("s2.y", "c2.u"),
    connect("s3.y", "c3.u"), connect("T.flange", "J1.flange", "c1.a"), connect("c1.b", "J2.flange", "c2.a"),
    connect("c2.b", "J3.flange", "c3.a"), connect("c3.b", "J4.flange") }
  local sol = m:integrate{ to = 1.2, rtol = 1e-9, atol = 1e-9 }
  expect(sol.status):equals "finished"
  for _, row in ipairs { { 0.3, 7.7073040448391, 2.92944021380747, 0, 0 },
    { 0.5, 5.95835760012241, 3.67744040291754, 1, 0 },
    { 0.75, 3.87945814614169, 3.21897005882986, 3.21897005882986, 0 },
    { 0.801, 3.33339544521, 3.33339544521, 3.33339544521, 0 } } do
    for k = 1, 4 do expect(sol(m["J" .. k].w, row[1])):near(row[k + 1],
      3e-4) end   -- the tool's steps: 0.01 s
  end
end)

test("a thermostat, Modelica.Thermal.HeatTransfer.Examples.ControlledTemperature", function()
  local reference = 298.15 + max(0, min(25, 25/6*(t - 2)))
  local m = model { V = e.source{ v = 10 }, S = e.switch{}, R = h.heating_resistor{ R = 10, alpha = 1/255 },
    gnd = e.ground{}, C = h.capacity{ C = 1, T0 = 293.15 }, G = h.conductor{ G = 0.1 },
    air = h.temperature{ T = 293.15 }, T = h.sensor{}, relay = s.relay{ low = -1, high = 1, y0 = 1 },
    connect("relay.y", "S.on"), connect("V.p", "S.p"), connect("S.n", "R.p"), connect("R.n", "V.n", "gnd.p"),
    connect("R.port", "C.port", "G.a", "T.port"), connect("G.b", "air.port"),
    var "relay.u" ~ reference - var "T.T" }
  local sol = m:integrate{ to = 7, rtol = 1e-9 }
  expect(sol.status):equals "finished"
  for _, row in ipairs { { 0.5, 297.980441919 }, { 1, 298.930000542 }, { 3, 301.672292791 }, { 5,
    310.521543593 },
    { 7, 318.801141335 } } do
    expect(sol(m.C.T, row[1])):near(row[2], 3e-6)                             -- 1 mK
  end
end)

test("a sampled speed controller, Modia's SynchronousExamples, at 1.5 s", function()
  local m = model { m = l.mass{ m = 1, s0 = 0, v0 = 5 }, d = l.damper{ d = 0.1 }, w = l.fixed{},
    F = l.signal_force{},
    S = s.sampler{ Ts = 0.1 }, P = s.gain{ k = 5 }, connect("w.flange", "d.a"), connect("d.b", "m.flange",
      "F.flange"),
    var "S.u" ~ 100 - var "m.v", connect("S.y", "P.u"), connect("P.y", "F.f") }
  local sol = m:integrate{ to = 1.5, rtol = 1e-9 }
  expect(sol(m.m.s, 1.5)):near(133.3845202465569, 1e-9)
  expect(sol(m.m.v, 1.5)):near(98.03694943140056, 1e-9)
end)

test("the Cauer filter's transfer function: zeros where its arms resonate, equal ripples that touch 1/2",
  function()
  local L, C, u = e.inductor, e.capacitor, input "u"
  local m = model { V = e.signal_source{}, R1 = e.resistor{}, R2 = e.resistor{}, gnd = e.ground{},
    connect("V.v", u),
    C1 = C{ C = 1.072 }, C2 = C{ C = 1/(1.704992^2*1.304) }, L1 = L{ L = 1.304 }, C3 = C{ C = 1.682 },
    C4 = C{ C = 1/(1.179945^2*0.8586) }, L2 = L{ L = 0.8586 }, C5 = C{ C = 0.7262 }, connect("V.p", "R1.p"),
    connect("R1.n", "C1.p", "C2.p", "L1.p"), connect("C2.n", "L1.n", "C3.p", "C4.p", "L2.p"),
    connect("C4.n", "L2.n", "C5.p", "R2.p"), connect("V.n", "C1.n", "C3.n", "C5.n", "R2.n", "gnd.p") }
  expect(m:index()):equals(2)
  local G = m:tf(u, m.C5.v)
  local function coefficients(list)
    local all = {}
    for k = 1, #list do all[k] = evaluate(list[k], {}) end
    return all
  end
  local num, den = coefficients(G.num), coefficients(G.den)
  expect(#num):equals(5)
  expect(#den):equals(6)
  local a, b = 1.704992^2, 1.179945^2                  -- (s² + a)(s² + b)
  for k, value in ipairs { 1, 0, a + b, 0, a*b } do expect(num[k]/num[1]):near(value, 1e-9) end
  local function gain(w)                               -- |G(iw)|
    local function size(list)
      local re, im, n = 0, 0, #list
      for k = 1, n do
        local power, c = n - k, list[k]*w^(n - k)
        if power % 2 == 0 then re = re + (power % 4 == 0 and c or -c) else im = im + (power % 4 == 1 and c or
          -c) end
      end
      return math.sqrt(re^2 + im^2)
    end
    return size(num)/size(den)
  end
  local largest, peaks = 0, 0
  for k = 1, 999 do
    local g = gain(k/1000)
    largest = math.max(largest, g)
    if g > gain((k - 1)/1000) and g > gain((k + 1)/1000) then peaks = peaks + 1 end
  end
  expect(gain(0)):near(0.5, 1e-9)
  expect(largest):near(0.5, 1e-3)                      -- an elliptic filter of fifth order: three times
  expect(peaks):equals(2)
end)

test("a Butterworth ladder and an inverting differentiator are exact", function()
  local L, C, u = e.inductor, e.capacitor, input "u"
  local b = model { V = e.signal_source{}, R1 = e.resistor{}, R2 = e.resistor{}, gnd = e.ground{},
    connect("V.v", u),
    C1 = C{ C = 1 }, L = L{ L = 2 }, C2 = C{ C = 1 }, connect("V.p", "R1.p"), connect("R1.n", "C1.p", "L.p"),
    connect("L.n", "C2.p", "R2.p"), connect("V.n", "C1.n", "C2.n", "R2.n", "gnd.p") }
  local G = b:tf(u, b.C2.v)
  expect(tostring(G.num) .. tostring(G.den)):equals "(1/2)(1, 2, 2, 1)"
  local d = model { V = e.signal_source{}, C = C{ C = 2 }, R = e.resistor{ R = 3 }, A = e.opamp{},
    gnd = e.ground{},
    connect("V.v", u), connect("V.p", "C.p"), connect("C.n", "A.n", "R.p"), connect("R.n", "A.out"),
    connect("V.n", "A.p", "gnd.p") }
  expect(tostring(d:tf(u, d.A.out.v)):find("-6 s", 1, true) ~= nil):is_true()
end)

test("two inertias and an ideal gear, Modia's TestTwoInertiasAndIdealGear, at 4 s", function()
  local pulse = ifelse(lt(t, 1), 1, ifelse(lt(t, 2), 0, ifelse(lt(t, 3), -1, 0)))
  local m = model { T = r.torque{ tau = pulse }, J1 = r.inertia{ J = 0.0025 }, g = r.gear{ ratio = 105 },
    J2 = r.inertia{ J = 170, phi0 = 0.5, w0 = 0 }, connect("T.flange", "J1.flange", "g.a"),
    connect("g.b", "J2.flange") }
  expect(m:index()):equals(3)
  local sol = m:integrate{ to = 4, rtol = 1e-9 }
  expect(sol(m.J2.phi, 4)):near(1.5628074713622309, 2e-4)   -- that tool steps over the edges of the pulses
  expect(sol(m.J2.phi, 4)):near(0.5 + 2*105/(170 + 0.0025*105^2), 1e-8)
  expect(sol(m.J2.w, 4)):near(0, 1e-8)
end)

-- Emitter and collector of one diode, no current back.
local transistor = component("transistor", { alpha = 0.99, beta = 1e-6, UF = 0.026 }, function(self)
  self.c, self.b, self.e = e.pin, e.pin, e.pin
  local g = self:var "g"
  return { g ~ self.beta*(exp((self.b.v - self.e.v)/self.UF) - 1), self.c.i ~ self.alpha*g,
    self.b.i ~ (1 - self.alpha)*g, self.e.i ~ -g }
end)

test("transistor amplifier of two stages, Test Set for IVP Solvers (Mazzia & Magherini, 2008), at 0.2 s",
  function()
  local R, C, T = e.resistor, e.capacitor, transistor
  local r = { R = 9000 }
  local m = model { Ue = e.source{ v = 0.1*sin(200*pi*t) }, Ub = e.source{ v = 6 }, gnd = e.ground{},
    R0 = R{ R = 1000 }, R1 = R(r), R2 = R(r), R3 = R(r), R4 = R(r), R5 = R(r), R6 = R(r), R7 = R(r),
    R8 = R(r), R9 = R(r), C1 = C{ C = 1e-6, v0 = -3 }, C2 = C{ C = 2e-6, v0 = 3 }, C3 = C{ C = 3e-6, v0 = 3 },
    C4 = C{ C = 4e-6, v0 = 3 }, C5 = C{ C = 5e-6, v0 = 6 }, Q1 = T{}, Q2 = T{},
    connect("Ue.p", "R0.p"), connect("R0.n", "C1.p"), connect("C1.n", "R1.p", "R2.n", "Q1.b"),
    connect("Q1.e", "R3.p", "C2.p"), connect("Q1.c", "R4.n", "C3.p"), connect("C3.n", "R5.p", "R6.n", "Q2.b"),
    connect("Q2.e", "R7.p", "C4.p"), connect("Q2.c", "R8.n", "C5.p"), connect("C5.n", "R9.p"),
    connect("Ub.p", "R2.p", "R4.p", "R6.p", "R8.p"),
    connect("Ub.n", "Ue.n", "R1.n", "R3.n", "C2.n", "R5.n", "R7.n", "C4.n", "R9.n", "gnd.p") }
  expect(m:index()):equals(1)
  local sol = m:integrate{ to = 0.2, rtol = 1e-9, atol = 1e-10 }
  for _, row in ipairs { { m.C1.p.v, -0.5562145012262709e-2 }, { m.Q1.b.v, 3.006522471903042 },
    { m.Q1.e.v, 2.849958788608128 }, { m.Q1.c.v, 2.926422536206241 }, { m.Q2.b.v, 2.704617865010554 },
    { m.Q2.e.v, 2.761837778393145 }, { m.Q2.c.v, 4.770927631616772 }, { m.R9.v, 1.236995868091548 } } do
    expect(sol(row[1], 0.2)):near(row[2], 1e-6)
  end
end)

test("bias of an amplifier, Roberts & Sedra, SPICE, 2nd ed., example 4.9: two digits", function()
  local m = model { Vcc = e.source{ v = 10 }, Vbb = e.source{ v = 3 }, gnd = e.ground{},
    Q = e.npn{ Is = 1.8104e-15, Bf = 100, Vt = 0.02586 }, Rc = e.resistor{ R = 3e3 },
    Rb = e.resistor{ R = 1e5 }, connect("Vcc.p", "Rc.p"), connect("Rc.n", "Q.c"), connect("Vbb.p", "Rb.p"),
    connect("Rb.n", "Q.b"), connect("Vcc.n", "Vbb.n", "Q.e", "gnd.p") }
  local at = m:init{}
  expect(at(m.Rb.i)):near(0.023e-3, 0.5e-6)
  expect(at(m.Rc.i)):near(2.3e-3, 0.05e-3)
end)
