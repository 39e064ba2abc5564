-- How uncertain masses and damping spread an answer: quantiles of 400 runs as a fan.
x, v = vars "x v"
m, d = params "m=1 d=0.4"
osc = dae { der(x) ~ v, m*der(v) ~ -4*x - d*v }
runs = sweep(osc, { start = { x = 1, v = 0 }, to = 10, times = linspace(0, 10, 51), runs = 400, seed = 1,
  params = { m = normal(1, 0.05), d = uniform(0.3, 0.5) } })
print(#runs, #runs.failures)
print("90 % of the runs end between", runs:quantile(x, 0.05), runs:quantile(x, 0.95))
print("x > 0 at the end:", runs:probability(gt(x, 0)))
fan = runs:fan(x, { title = "x of 400 runs" })
fan:save "fan.svg"
print(fan)
runs:histogram(x, { xlabel = "x at t = 10" }):save "final.svg"
