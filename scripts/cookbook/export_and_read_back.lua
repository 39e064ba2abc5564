-- A run as CSV, read back under the names that are typed.
theta = var "theta"
swing = dae { der(theta, 2) ~ -9.81*sin(theta) - 0.1*theta.dot }
sol = swing:integrate { start = { theta = 1, [theta.dot] = 0 }, to = 5, times = linspace(0, 5, 51) }
sol:csv "swing.csv"
for line in io.lines "swing.csv" do print(line) break end
data = iddata.read("swing.csv", { y = { "theta", "theta'" } })
print(data)
