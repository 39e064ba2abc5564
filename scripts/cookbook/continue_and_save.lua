-- A run that goes on, values that come back in another session.
x, v = vars "x v"
k = param("k", 4)
osc = dae { der(x) ~ v, der(v) ~ -k*x }
first = osc:integrate { start = { x = 1, v = 0 }, to = 5, rtol = 1e-9, atol = 1e-9 }
second = first:continue { to = 10, rtol = 1e-9, atol = 1e-9 }
print(("%.6f %.6f"):format(second(x, 10), math.cos(20)))

save("work.lua", { model = osc, at = second:state(), note = "at t = 10" })
again = load "work.lua"
print(again.note, ("%.6f"):format(again.at(x)))
third = again.model:integrate { start = again.at, to = 12, rtol = 1e-9, atol = 1e-9 }
print(("%.6f %.6f"):format(third(x, 12), math.cos(24)))
