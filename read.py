import json
run = json.load(open("run.json"))
print(run["status"], len(run["t"]), "times")
for t, x in zip(run["t"], run["values"]["x"]):
    print(f"{t:.0f} {x:+.6f}")
