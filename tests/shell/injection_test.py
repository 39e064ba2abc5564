"""Faults on purpose: one call of malloc, write, open, mmap, fork or rename fails, or all from one on. The program ends with
its results or with a message; it never crashes or hangs, and leaves no half-written file. More places: injection_test.py 1000"""
import os
import random
import subprocess
import sys
import tempfile

PROGRAM = os.environ["PENDULA"]
LIBRARY = os.path.join(os.path.dirname(PROGRAM), "tests", "libfail_at.so")
places = int(sys.argv[1]) if len(sys.argv) > 1 else 8
random.seed(11)

with open(PROGRAM, "rb") as file:
    if b"__asan_init" in file.read():
        print("skipped: the sanitizers bring their own malloc")
        sys.exit(0)

ANALYSIS = """
x, y, k = var "x", var "y", param("k", 1)
print(factor(x^4 - 1))
sys = dae{ der(x) ~ -k*y, 0 ~ x + y - 1 }
print(sys:index(), sys:reduce())
sol = sys:integrate{ start = { x = 1 }, to = 1 }
sol:csv "s.csv"
save("m.lua", sys)
print(#tf({1}, {1, 2, 3}):poles())
"""
SWEEP = """
x, k = var "x", param("k", 1)
s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, runs = 40, workers = 2,
  store = "r.db" })
print(#s.failures, ("%.5f"):format(s:quantile(x, 0.5)))  -- runs go one by one where lanes fail: within the tolerance
f = parallel_calls(4, function(i) return i^2 end, { workers = 2 })
print(f[2])
"""


def run(folder, code, call, **more):
    environment = dict(os.environ, LD_PRELOAD=LIBRARY, FAIL_CALL=call, **more)
    return subprocess.run([PROGRAM, "-e", code], capture_output=True, text=True, env=environment, timeout=60, cwd=folder)


def calls(code, call):
    with tempfile.TemporaryDirectory() as folder:
        done = run(folder, code, call, FAIL_COUNT="count")
        assert done.returncode == 0, done
        with open(os.path.join(folder, "count")) as file:
            return int(file.read()), done.stdout


for code in (ANALYSIS, SWEEP):
    for call in ("alloc", "write", "open", "mmap", "fork", "rename"):
        total, expected = calls(code, call)
        if total <= places:
            chosen = range(1, total + 1)
        else:  # as many early ones as late ones
            chosen = {max(1, int(total**random.random())) for _ in range(places)} | {
                random.randint(1, total) for _ in range(places)}
        for k in sorted(chosen):
            for for_good in ({}, {"FAIL_ON": "1"}):
                where = (call, k, for_good)
                with tempfile.TemporaryDirectory() as folder:
                    done = run(folder, code, call, FAIL_AT=str(k), **for_good)
                    left = os.listdir(folder)
                    assert not [name for name in left if name.startswith(".pendula-draft")], (where, left)
                    if "m.lua" in left:
                        whole = subprocess.run([PROGRAM, "-e", "print(load 'm.lua')"], capture_output=True, cwd=folder)
                        assert whole.returncode == 0, (where, whole)
                assert done.returncode in (0, 1), (where, done)
                assert (done.returncode == 0 and done.stdout == expected) or done.stderr, (where, done)
print("every injected fault was survived")
