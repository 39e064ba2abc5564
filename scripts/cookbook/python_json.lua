-- Results for Python: a run as JSON, read by a Python program.
x, v = vars "x v"
osc = dae { der(x) ~ v, der(v) ~ -x }
sol = osc:integrate { start = { x = 1, v = 0 }, to = 6, times = linspace(0, 6, 7), rtol = 1e-9, atol = 1e-9 }
json(sol, "run.json")
file = io.open("read.py", "w")
file:write [[
import json
run = json.load(open("run.json"))
print(run["status"], len(run["t"]), "times")
for t, x in zip(run["t"], run["values"]["x"]):
    print(f"{t:.0f} {x:+.6f}")
]]
file:close()
program = io.popen "python3 read.py"
print((program:read "a"))
program:close()
