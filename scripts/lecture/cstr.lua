-- Lecture 10, some examples of DAEs: the isothermal stirred tank (with the corrections of the errata).
-- A ⇌ B in equilibrium, B → C. V, C_A, C_B, C_C are differential, R_1, R_2 algebraic, F and F_a inputs.
--
--   ./dev run scripts/lecture/cstr.lua

V, CA, CB, CC, R1, R2 = vars "V C_A C_B C_C R_1 R_2"
Fa, F = inputs "F_a F"
CA0, Keq, k2 = params "C_A0=2 K_eq=3 k_2=0.4"
tank = dae {
  der(V)  ~ Fa - F,
  der(CA) ~ Fa/V*(CA0 - CA) - R1,
  der(CB) ~ -Fa/V*CB + R1 - R2,
  der(CC) ~ -Fa/V*CC + R2,
  0 ~ CA - CB/Keq,
  0 ~ R2 - k2*CB,
  name = "isothermal CSTR",
}
print(tank)

print "\nIndex 2: R_1 appears in no algebraic equation"
print(tank:structure())
print(tank:constraints())
assert(tank:index() == 2 and tank:dof() == 3 and #tank:constraints() == 1)

print "\nReduction: the equilibrium is differentiated once"
low = tank:reduce "acc"
print(low:trace())

print "\nThe rate R₁ that keeps the equilibrium: d/dt (5) with (2), (3) and (6), then C_A = C_B/K_eq"
rate = der(CA - CB/Keq)
rate = subs(rate, { [CA.dot] = Fa/V*(CA0 - CA) - R1, [CB.dot] = -Fa/V*CB + R1 - R2 })
print("0 =", rate)
R1_found = solve({ subs(rate, { [R2] = k2*CB, [CA] = CB/Keq }) }, { R1 })[1][R1]
print("R₁ =", R1_found)
formula = (Keq*Fa*CA0/V + k2*CB)/(1 + Keq)
expect(R1_found):equals(formula)
feed = { [Fa] = 1, [F] = 0.5 }
at = tank:init { fix = { V = 2, C_B = 1.5, C_C = 0.1 }, inputs = feed }
print(at:ledger())
print(("R_1 by init %.10f, by the formula %.10f"):format(at(R1), at(formula)))
expect(at(R1)):near(at(formula), 1e-12)
expect(at(R1)):near(0.9, 1e-12)                    -- (3·1·2/2 + 0.4·1.5)/4

print "\nTwo hours: the equilibrium and the formula hold throughout"
sol = low:integrate { start = at, to = 2, inputs = feed, method = rk.gauss(3), dt = 0.1 }
print(" t     V       C_A      C_B      C_C      R_1")
for _, time in ipairs { 0, 0.5, 1, 1.5, 2 } do
  print(("%.1f  %.3f  %.5f  %.5f  %.5f  %.5f"):format(time, sol(V, time), sol(CA, time), sol(CB, time),
    sol(CC, time), sol(R1, time)))
  expect(sol(CA - CB/Keq, time)):near(0, 1e-9)
  expect(sol(R1 - formula, time)):near(0, 1e-9)
end
-- Extrapolated end values of the ODE for V, S = C_A + C_B and C_C (problems.cstr).
expect(sol(vec { CA, CB, CC }, 2)):near({ 0.33499446011, 1.00498338034, 0.70446660399 }, 1e-10)

print "\nOne concentration is free, not two:"
print((select(2, pcall(function() tank:init { fix = { V = 2, C_A = 1, C_B = 1.5, C_C = 0.1 },
  inputs = feed } end)):gsub("^[^ ]* ", "")))
