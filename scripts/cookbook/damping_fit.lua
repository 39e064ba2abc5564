-- The damping of an oscillator from measured positions.
x, v = vars "x v"
d, k = param("d", 0.2), param("k", 4)
osc = dae { der(x) ~ v, der(v) ~ -d*v - k*x }

seed(1)
times = linspace(0, 10, 101)
run = osc:integrate { start = { x = 1, v = 0 }, to = 10, times = times, rtol = 1e-9,
  atol = 1e-9, params = { d = 0.35 } }
measured = {}
for i = 1, 101 do measured[i] = run(x)[i] + 0.01*randn() end

result = fit(osc, { params = { d }, data = iddata { y = measured, Ts = 0.1 }, y = x,
  start = { x = 1, v = 0 } })
print(("d = %.2f ± %.2f"):format(result(d), 2*result.std[1]))
print("true value within two deviations:", math.abs(result(d) - 0.35) < 2*result.std[1])
