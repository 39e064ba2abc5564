-- A resonant circuit: its equation, its resonance, the answer to a step.
i, u = vars "i u"
e = input "e"
R, L, C = param("R", 10), param("L", 1e-3), param("C", 1e-6)
circuit = dae { L*der(i) + R*i + u ~ e, C*der(u) ~ i }
print(circuit)

G = circuit:linearize(circuit:init { fix = { i = 0, u = 0 }, inputs = { e = 0 } }, { outputs = { u } })
print(G:tf())
print(G:poles())
print(("resonance at %.0f rad/s"):format(1/math.sqrt(1e-3*1e-6)))
sol = circuit:integrate { start = { i = 0, u = 0 }, to = 2e-3, inputs = { e = 1 } }
top = 0
for k = 0, 2000 do top = math.max(top, sol(u, k*1e-6)) end
print(("largest voltage: %.3f V"):format(top))
plot(sol, { u, i }, { right = { 2 }, ylabel = "u [V]", y2label = "i [A]" }):save "step.svg"
