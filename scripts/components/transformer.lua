-- Coupled inductors as a transformer against the ideal one: a step of 1 V on the primary side.
local e = components.electrical
local M = 0.9
local real = model { V = e.source{ v = 1 }, R1 = e.resistor{ R = 1 }, R2 = e.resistor{ R = 2 },
  T = e.coupled_inductors{ L1 = 1, L2 = 1, M = M }, g1 = e.ground{}, g2 = e.ground{},
  connect("V.p", "R1.p"), connect("R1.n", "T.p1"), connect("V.n", "T.n1", "g1.p"), connect("T.p2", "R2.p"),
  connect("T.n2", "R2.n", "g2.p"), start = { ["T.i1"] = 0, ["T.i2"] = 0 } }
local sol = real:integrate{ to = 1, rtol = 1e-10, atol = 1e-12 }
-- [1 M; M 1] i' = [1 - i1; -2 i2]
local A = -inv(mat{{1, M}, {M, 1}})*mat{{1, 0}, {0, 2}}
local b = inv(mat{{1, M}, {M, 1}})*vec{1, 0}
local exact = inv(A)*(expm(A) - eye(2))*b
print(("i1(1) = %.8f, i2(1) = %.8f"):format(sol(real.T.i1, 1), sol(real.T.i2, 1)))
print(("exact   %.8f          %.8f"):format(evaluate(exact)[1], evaluate(exact)[2]))
