# A store survives what happens to sweeps: kill -9, a full disk, Ctrl-C, folders that may only be read.
import json, os, resource, shutil, signal, sqlite3, struct, subprocess, tempfile, time, zlib

pendula = os.environ["PENDULA"]
folder = tempfile.mkdtemp(prefix="pendula_store_")
db = folder + "/runs.db"
log = folder + "/log"
RUNS = 12000 if os.environ.get("PENDULA_LONG") else 2000  # they take a second: time enough to kill them in the middle
PATIENCE = float(os.environ.get("PENDULA_PATIENCE", "30"))  # seconds; sanitizers need more

SCRIPT = """
x, k = var "x", param("k", 1)
sys = dae { der(x) ~ -k*x }
options = { start = { x = 1 }, to = 1, params = { k = uniform(1, 2) }, runs = %(runs)d, seed = 3, times = { 0, 0.5, 1 },
  method = "bogacki_shampine", rtol = %(rtol)s, atol = 1e-14, workers = 2, store = "%(db)s",
  events = { { when = x - 0.9, call = function(sol)
    local file = io.open("%(log)s", "a")
    file:write(("%%.17g\\n"):format(sol(k)[1]))
    file:close()
  end } } }
s = sweep(sys, options)
print("finished", #s - #s.failures)
"""

def script(**values):
    text = SCRIPT % dict(dict(runs=RUNS, rtol="1e-11", db=db, log=log), **values)
    name = folder + "/script.lua"
    with open(name, "w") as file:
        file.write(text)
    return name

def fresh():
    for name in os.listdir(folder):
        os.remove(folder + "/" + name)

def stored():
    if not os.path.exists(db):
        return []
    with sqlite3.connect(db) as connection:
        try:
            return connection.execute("select run, k, x from runs where status = 'done' order by run").fetchall()
        except sqlite3.OperationalError:
            return []

def run(name, **options):
    return subprocess.run([pendula, name], capture_output=True, text=True, timeout=4*PATIENCE, **options)

def start(name):
    return subprocess.Popen([pendula, name], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

def wait_for(condition, seconds=2*PATIENCE):
    end = time.time() + seconds
    while not condition():
        assert time.time() < end, "nothing happened in time"
        time.sleep(0.02)

def killed_and_resumed():
    fresh()
    process = start(script())
    wait_for(lambda: len(stored()) > 20)
    process.kill()
    process.wait()
    before = stored()
    assert 20 < len(before) < RUNS, len(before)
    with open(log) as file:
        lines = file.read().split()
    time.sleep(0.2)                                     # the workers are gone with their parent
    with open(log) as file:
        assert len(file.read().split()) <= len(lines) + 2
    os.remove(log)
    result = run(script())
    assert "finished %d" % RUNS in result.stdout, result
    after = stored()
    assert [row for row in after if row[0] in {b[0] for b in before}] == before
    with open(log) as file:
        again = {float(line) for line in file}
    assert not again & {row[1] for row in before}, "a run was computed twice"
    assert len(again) == RUNS - len(before)
    result = run(script())                              # nothing is left to do
    with open(log) as file:
        assert len(file.read().split()) == RUNS - len(before)

def one_equals_interrupted():
    rows = stored()
    fresh()
    assert "finished %d" % RUNS in run(script()).stdout
    assert stored() == rows, "a resumed sweep differs from one in a piece"
    with sqlite3.connect(db) as connection:             # trajectories, as docs/store.md says
        leaves = [row[0] for row in connection.execute("select name from quantity where role = 'kept' order by number")]
        block, x = connection.execute("select block, x from saved join runs using (run) where run = 7").fetchone()
    planes = zlib.decompress(block)
    count = len(planes) // 8
    numbers = [struct.unpack("<d", bytes(planes[k*count + i] for k in range(8)))[0] for i in range(count)]
    assert count == 3*len(leaves)
    assert numbers[leaves.index("x")] == 1 and numbers[2*len(leaves) + leaves.index("x")] == x

def interrupted():
    fresh()
    process = start(script())
    wait_for(lambda: len(stored()) > 10)
    process.send_signal(signal.SIGINT)
    process.wait()
    kept = len(stored())
    assert 10 < kept < RUNS, kept
    assert "finished %d" % RUNS in run(script()).stdout

def full():
    fresh()
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (120000, 120000))
    result = run(script(runs=2000, rtol="1e-3"), preexec_fn=limit)
    assert result.returncode == 1 and "disk is full" in result.stderr, result
    some = len(stored())
    result = run(script(runs=2000, rtol="1e-3"))
    assert "finished 2000" in result.stdout, result
    assert len(stored()) == 2000 and some < 2000

def refused():
    fresh()
    result = run(script(db=folder + "/none/runs.db"))
    assert "no such file or folder" in result.stderr, result
    run(script(runs=5))
    result = run(script(runs=6))
    assert "holds another sweep" in result.stderr, result
    process = start(script(db=folder + "/two.db", rtol="1e-12"))
    wait_for(lambda: os.path.exists(log) and os.path.getsize(log) > 200)
    result = run(script(db=folder + "/two.db", rtol="1e-12"))
    assert "being written by another sweep" in result.stderr, result
    process.kill()
    process.wait()
    if os.getuid() != 0:
        os.mkdir(folder + "/read", 0o500)
        assert "may" in run(script(db=folder + "/read/runs.db")).stderr

def crashed():
    fresh()
    process = start(script(rtol="1e-12"))
    wait_for(lambda: os.path.exists(log))
    wait_for(lambda: len(subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True).stdout.split()) == 2)
    worker = int(subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True).stdout.split()[0])
    time.sleep(0.1)
    os.kill(worker, signal.SIGKILL)
    assert "finished %d" % (RUNS - 1) in process.communicate(timeout=4*PATIENCE)[0]
    with sqlite3.connect(db) as connection:
        why = connection.execute("select why from runs where status = 'failed'").fetchall()
    assert why == [("its worker process ended unexpectedly (signal 9)",)], why

def sharded():
    fresh()
    name = folder + "/shards.lua"
    with open(name, "w") as file:
        file.write("""
x, k = var "x", param("k", 1)
sweep(dae { der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = uniform(1, 2) }, runs = 400, seed = 3, lanes = 1,
  method = "bogacki_shampine", rtol = 1e-11, atol = 1e-14, store = "%s", shards = 4 })
""" % db)
    run(name)
    command = [pendula, "shard", "-j", "1"]
    # Two on one shard, one that is killed in the middle of another.
    two = [subprocess.Popen(command + [db + ".d/1"], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    killed = subprocess.Popen(command + [db + ".d/2"])
    wait_for(lambda: any(name.startswith("2.part") for name in os.listdir(db + ".d")))
    killed.kill()
    killed.wait()
    said = sorted(process.communicate(timeout=2*PATIENCE)[0].split(": ")[1].strip() for process in two)
    assert said[0] == "done" and said[1] in ("done before", "done by another"), said
    here = shutil.which("parallel")                     # GNU parallel; over ssh: --sshlogin node1,node2
    if here:
        subprocess.run([here, "--will-cite", "--sshlogin", "2/:", " ".join(command), "{}", ":::"]
                       + [db + ".d/%d" % number for number in (2, 3, 4)], check=True, capture_output=True)
    else:
        subprocess.run(command + [db + ".d/%d" % number for number in (2, 3, 4)], check=True, capture_output=True)
    result = subprocess.run([pendula, "sweep", "collect", db], capture_output=True, text=True)
    assert "400 of 400 runs finished, 0 of them failed" in result.stdout, result
    shutil.rmtree(db + ".d")

try:
    for test in (killed_and_resumed, one_equals_interrupted, interrupted, full, refused, crashed, sharded):
        begin = time.time()
        test()
        print("%s: passed (%.1f s)" % (test.__name__, time.time() - begin), flush=True)
finally:
    shutil.rmtree(folder, ignore_errors=True)
