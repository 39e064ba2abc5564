-- How uncertain masses and damping spread an answer: quantiles of 400 runs as a fan.
x, v = vars "x v"
m, d = params "m=1 d=0.4"
osc = dae { der(x) ~ v, m*der(v) ~ -4*x - d*v }
runs = sweep(osc, { start = { x = 1, v = 0 }, to = 10, times = linspace(0, 10, 51), runs = 400, seed = 1,
  params = { m = normal(1, 0.05), d = uniform(0.3, 0.5) } })
print(#runs, #runs.failures)

values, low, high = runs(x), {}, {}        -- one row per time, one column per run
for i = 1, 51 do
  local row = {}
  for j = 1, #runs do row[j] = values(i, j) end
  low[i], high[i] = quantile(row, 0.05), quantile(row, 0.95)
end
fan = overlay(band(runs.t, low, high, { title = "90 % of the runs" }), plot(runs.t, high), plot(runs.t, low))
print(fan)
histogram(runs:final(x), { xlabel = "x at t = 10" }):save "final.svg"
