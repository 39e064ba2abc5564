-- Chua's circuit: two capacitors, an inductor and a resistor with a negative slope oscillate chaotically.
-- Matsumoto, IEEE Trans. Circuits Syst. 31(12), 1984; values of Kennedy, 1992, scaled to 1.
local e = components.electrical

local chua_diode = component("chua_diode", { Ga = -0.757576, Gb = -0.409091, Ve = 1 }, function(self)
  self.p, self.n = e.pin, e.pin
  local v, i = self:vars "v i"
  local slope, Ve = self.Ga - self.Gb, self.Ve
  return { v ~ self.p.v - self.n.v, i ~ self.p.i, 0 ~ self.p.i + self.n.i,
    i ~ self.Gb*v + slope/2*(abs(v + Ve) - abs(v - Ve)) }
end, { text = "Five straight lines, the middle three with negative slope.", source = "Chua, 1983" })

local circuit = model {
  L = e.inductor{ L = 18, i0 = 0 }, Ro = e.resistor{ R = 12.5e-3 }, G = e.conductor{ G = 0.565 },
  C1 = e.capacitor{ C = 10, v0 = 4 }, C2 = e.capacitor{ C = 100, v0 = 0 }, Nr = chua_diode{},
    gnd = e.ground{},
  connect("L.n", "Ro.p"), connect("L.p", "C2.p", "G.p"), connect("G.n", "C1.p", "Nr.p"),
  connect("Ro.n", "C2.n", "C1.n", "Nr.n", "gnd.p") }

print(circuit)
print(("index %d, %d free initial values"):format(circuit:index(), circuit:dof()))
local sol = circuit:integrate{ to = 500, rtol = 1e-9, atol = 1e-10 }

-- the same equations by hand
local v1, v2, i = vars "v1 v2 i"
local function g(v) return -0.409091*v + (-0.757576 + 0.409091)/2*(abs(v + 1) - abs(v - 1)) end
local hand = dae { 10*der(v1) ~ 0.565*(v2 - v1) - g(v1), 100*der(v2) ~ 0.565*(v1 - v2) - i,
  18*der(i) ~ v2 - 12.5e-3*i }
local other = hand:integrate{ start = { v1 = 4, v2 = 0, i = 0 }, to = 500, rtol = 1e-9, atol = 1e-10 }
print(("v of C1 at 500: %.4f, by hand %.4f"):format(sol(circuit.C1.v, 500), other(v1, 500)))
print(plot(sol, circuit.C1.v, circuit.C2.v))
