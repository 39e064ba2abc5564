-- A model of measured data in a CSV file: read, split, choose orders, validate.
file = io.open("heater.csv", "w")
file:write "time;power;temperature\n"
seed(3)
y, u = { 0, 0 }, {}
for k = 1, 400 do
  u[k] = rand() > 0.5 and 1 or 0
  if k > 2 then y[k] = 1.5*y[k - 1] - 0.6*y[k - 2] + 0.1*u[k - 1] + 0.005*randn() end
  file:write(("%g;%g;%g\n"):format(0.5*k, u[k], y[k]))
end
file:close()

data = iddata.read("heater.csv", { y = "temperature", u = "power" })
estimate, fresh = data:split(0.5)
scan = order_scan(estimate, fresh, { na = { 1, 3 }, nb = { 1, 2 }, nk = { 1, 2 } })
print(scan.best)
model = arx(estimate, { na = 2, nb = 1, nk = 1 })
for k, name in ipairs(model.names) do
  print(("%s = %.3f ± %.3f"):format(name, model.theta[k], 2*model.std[k]))
end
print(("simulation fit on fresh data: %.0f %%"):format(compare(fresh, { arx = model })[1].simulation))
