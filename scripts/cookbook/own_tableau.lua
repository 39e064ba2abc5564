-- A Runge-Kutta method of one's own: its order proved and measured.
ralston = tableau { name = "ralston", A = { { 0, 0 }, { "2/3", 0 } }, b = { "1/4", "3/4" }, c = { 0, "2/3" } }
print(ralston:order(), ralston:is "explicit")

x = var "x"
study = converge(dae { der(x) ~ -x^2 }, { start = { x = 1 }, to = 1, methods = { ralston, rk.rk4 },
  dt = { 0.1, 0.05, 0.025 }, exact = { x = 1/(1 + t) } })
for i = 1, 2 do print(("measured order %.1f"):format(study.slopes[i])) end
