#!/usr/bin/python3
"""What sweeps cost beside the runs themselves: processor time of N runs of about a millisecond, made one by one in one
process, by a sweep, by a sweep with a store, and by a sweep that goes on from half of its store.

    PENDULA=build/release/pendula bench/sweep_overhead.py [runs]

Processor time and not time on the clock, so that the ratios mean something on a machine that does other things too;
bounds: sweep 1.15, store and resume 1.05 of the sweep."""
import os, resource, subprocess, sys, tempfile, time

pendula = os.environ.get("PENDULA", "build/release/pendula")
runs = int(sys.argv[1]) if len(sys.argv) > 1 else 4000
folder = tempfile.mkdtemp(prefix="pendula_overhead_")

MODEL = """
x, k = var "x", param("k", 1)
sys = dae { der(x) ~ -k*x }
options = { start = { x = 1 }, to = 1, params = { k = uniform(1, 2) }, runs = %d, seed = 3, workers = 2,
  method = "bogacki_shampine", rtol = 1e-11, atol = 1e-14, lanes = 1, times = { 1 } }
""" % runs

CASES = {
    "pure": """
options.params, options.runs, options.seed, options.lanes, options.workers = nil, nil, nil, nil, nil
for i = 1, %d do
  options.params = { k = 1 + (i - 0.5)/%d }
  sys:integrate(options)
end""" % (runs, runs),
    "sweep": "sweep(sys, options)",
    "store": "options.store = '%s/runs.db' sweep(sys, options)" % folder,
    "resume": "options.store = '%s/half.db' sweep(sys, options)" % folder,
}


def cpu(code):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.time()
    subprocess.run([pendula, "-e", MODEL + code], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, time.time() - begin


def half():
    """A store of which a kill has left about the half."""
    process = subprocess.Popen([pendula, "-e", MODEL + CASES["resume"]])
    import sqlite3
    while process.poll() is None:
        time.sleep(0.05)
        try:
            with sqlite3.connect(folder + "/half.db") as connection:
                if connection.execute("select count(*) from runs").fetchone()[0] >= runs // 2:
                    process.kill()
        except sqlite3.Error:
            pass
    with sqlite3.connect(folder + "/half.db") as connection:
        return connection.execute("select count(*) from runs").fetchone()[0]


results = {name: cpu(code) for name, code in CASES.items() if name != "resume"}
there = half()
left = cpu(CASES["resume"])
for name, (seconds, wall) in results.items():
    print("%-7s %8.2f s processor, %8.2f s, %6.3f of pure" % (name, seconds, wall, seconds / results["pure"][0]))
print("resume  %8.2f s processor for the %d runs that were left: %.3f of the sweep's share" % (
    left[0], runs - there, left[0] / (results["sweep"][0] * (runs - there) / runs) if there < runs else 0))
