-- Operational amplifiers: inverting and non-inverting, integrator, differentiator (index 2), Schmitt trigger.
local e = components.electrical

local function amplifier(first, second, source)
  return model { V = e.source{ v = source }, a = first, b = second, A = e.opamp{}, gnd = e.ground{},
    connect("V.p", "a.p"), connect("a.n", "A.n", "b.p"), connect("b.n", "A.out"),
      connect("V.n", "A.p", "gnd.p") }
end

local inverting = amplifier(e.resistor{ R = 1000 }, e.resistor{ R = 4700 }, 2)
print(("inverting:      out = %.4f = -R2/R1 v"):format(inverting:init{}(inverting.A.out.v)))

local integrator = amplifier(e.resistor{ R = 1000 }, e.capacitor{ C = 1e-3, v0 = 0 }, 1)
print(("integrator:     out(2) = %.4f = -t/(R C), index %d"):format(integrator:integrate{
  to = 2 }(integrator.A.out.v, 2),
  integrator:index()))

local differentiator = amplifier(e.capacitor{ C = 1e-3 }, e.resistor{ R = 1000 }, sin(t))
print(("differentiator: out(1) = %.4f = -R C cos 1 = %.4f, index %d"):format(
  differentiator:dae():init{ from = 1 }(differentiator.A.out.v), -math.cos(1), differentiator:index()))

local plus = model { V = e.source{ v = 2 }, R1 = e.resistor{ R = 1000 }, R2 = e.resistor{ R = 3000 },
  A = e.opamp{},
  gnd = e.ground{}, connect("V.p", "A.p"), connect("A.out", "R2.p"), connect("R2.n", "A.n", "R1.p"),
  connect("R1.n", "V.n", "gnd.p") }
print(("non-inverting:  out = %.4f = (1 + R2/R1) v"):format(plus:init{}(plus.A.out.v)))

local s = components.signals
local trigger = model { comparator = s.relay{ low = -1, high = 1, off = -15, on = 15 },
  z = s.first_order{ T = 0.1 }, connect("comparator.u", 2*sin(t)), connect("comparator.y", "z.u") }
local sol = trigger:integrate{ to = 20 }
print(("Schmitt trigger: switches at t = asin(1/2) = %.6f; after 20 s it is at %g V"):format(math.asin(0.5),
  sol(trigger.comparator.y, 20)))
