"""Sweeps on a real Slurm of two nodes on this host (./dev test-cluster): slurmctld and two slurmd as plain processes.

A sweep whose node, worker, task and submitting process are killed completes, every run once, equal to a local one."""
import getpass, os, shutil, signal, socket, sqlite3, subprocess, sys, tempfile, time

PENDULA = os.environ["PENDULA"]
RUNS = int(os.environ.get("RUNS", "2000"))

CONF = """
ClusterName=pendula
SlurmctldHost={host}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
SlurmctldPort={port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SlurmdTimeout=5
MinJobAge=300
JobRequeue=1
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MpiDefault=none
NodeName=n1 NodeHostname={host} Port={port1} CPUs=2 State=UNKNOWN
NodeName=n2 NodeHostname={host} Port={port2} CPUs=2 State=UNKNOWN
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""

SCRIPT = """
x, k = var "x", param("k", 1)
sys = dae {{ der(x) ~ -k*x }}
options = {{ start = {{ x = normal(1, 0.1) }}, to = 1, params = {{ k = uniform(1, 2) }}, runs = {runs}, seed = 3,
  method = "bogacki_shampine", rtol = 1e-12, atol = 1e-15, lanes = 1 {more} }}
s = sweep(sys, options)
print("finished", #s - #s.failures)
"""


class Slurm:
    def __init__(self, folder):
        self.folder, self.processes = folder, {}
        ports = []
        for _ in range(3):
            with socket.socket() as s:
                s.bind(("", 0))
                ports.append(s.getsockname()[1])
        self.conf = folder + "/slurm.conf"
        with open(self.conf, "w") as file:
            file.write(CONF.format(host=socket.gethostname().split(".")[0], user=getpass.getuser(), folder=folder,
                                   port=ports[0], port1=ports[1], port2=ports[2]))
        os.environ["SLURM_CONF"] = self.conf
        for name in ("state", "spool.n1", "spool.n2"):
            os.makedirs(folder + "/" + name)
        self.start("slurmctld", ["slurmctld", "-D", "-f", self.conf])
        for node in ("n1", "n2"):
            self.start(node, ["slurmd", "-D", "-N", node, "-f", self.conf])
        wait_for(lambda: self.idle() == 2, "two idle nodes", 30)

    def start(self, name, command):
        log = open(self.folder + "/" + name + ".out", "w")
        self.processes[name] = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)

    def idle(self):
        out = subprocess.run(["sinfo", "-h", "-N", "-o", "%N %T"], capture_output=True, text=True).stdout
        return sum(1 for line in out.splitlines() if line.split()[1:] == ["idle"])

    def queue(self, *options):
        out = subprocess.run(["squeue", "-h", "-r", "-o", "%F_%K %T %N", *options], capture_output=True, text=True)
        return [line.split() for line in out.stdout.splitlines()]

    def end(self):
        subprocess.run(["scancel", "-u", getpass.getuser()], capture_output=True)
        time.sleep(0.5)
        for process in self.processes.values():
            process.kill()
            process.wait()


def wait_for(condition, what, seconds=120):
    end = time.time() + seconds
    while True:
        value = condition()
        if value:
            return value
        assert time.time() < end, "in vain waited for " + what
        time.sleep(0.1)


def say(text, since):
    print("%5.1f s  %s" % (time.time() - since, text), flush=True)


def rows(db):
    with sqlite3.connect(db) as connection:
        return connection.execute("select run, status, k, \"x(0)\", x, steps from runs order by run").fetchall()


def children(pid):
    return [int(word) for word in subprocess.run(["pgrep", "-P", str(pid)], capture_output=True).stdout.split()]


def shard_workers():
    """Processes of shards that run now."""
    found = []
    for pid in os.listdir("/proc"):
        if not pid.isdigit():
            continue
        try:
            with open("/proc/%s/cmdline" % pid, "rb") as file:
                words = file.read().split(b"\0")
        except OSError:
            continue
        if words[1:2] == [b"shard"] and words[0].endswith(b"pendula"):
            found.append(int(pid))
    return found


def script(folder, name, **values):
    path = folder + "/" + name
    with open(path, "w") as file:
        file.write(SCRIPT.format(**dict(dict(runs=RUNS, more=""), **values)))
    return path


def refusals(folder):
    on = ', store = "%s/none.db", on = slurm { tasks = 2 }' % folder
    away = subprocess.run([PENDULA, script(folder, "away.lua", more=on)], capture_output=True, text=True,
                          env=dict(os.environ, PATH="/usr/sbin:/sbin"))
    assert "there is no program 'sbatch' here" in away.stderr, away
    wrong = ', store = "%s/wrong.db", on = slurm { tasks = 2, partition = "nowhere" }' % folder
    result = subprocess.run([PENDULA, script(folder, "wrong.lua", more=wrong)], capture_output=True, text=True)
    assert "sbatch refused" in result.stderr and "partition" in result.stderr, result


def main():
    since = time.time()
    folder = tempfile.mkdtemp(prefix="pendula_cluster_")
    slurm = None
    try:
        slurm = Slurm(folder)
        say("Slurm is up", since)
        refusals(folder)
        say("what cannot be is refused", since)
        local = folder + "/local.db"
        subprocess.run([PENDULA, script(folder, "local.lua", more=', store = "%s"' % local)], check=True)
        say("%d runs made here" % RUNS, since)

        db = folder + "/runs.db"
        on = ', store = "%s", on = slurm { tasks = 4, shards = 16, time = "10min" }' % db
        submitter = subprocess.Popen([PENDULA, script(folder, "cluster.lua", more=on)])
        wait_for(lambda: len(slurm.queue("-t", "RUNNING")) >= 3, "tasks that run")
        say("tasks run: " + " ".join(" ".join(task) for task in slurm.queue("-t", "RUNNING")), since)
        submitter.kill()
        submitter.wait()
        say("the submitting process is killed", since)
        wait_for(shard_workers, "a worker")
        os.kill(shard_workers()[0], signal.SIGKILL)
        say("a worker is killed", since)
        task = wait_for(lambda: slurm.queue("-t", "RUNNING"), "a task")[-1][0]
        subprocess.run(["scancel", task])
        say("task %s is cancelled" % task, since)
        slurm.processes["n2"].kill()
        slurm.processes["n2"].wait()
        say("node n2 is killed", since)
        before = [line for line in os.listdir(db + ".d") if line.endswith(".done")]
        assert len(before) < 16, "everything was finished before it was disturbed"

        attach = subprocess.run([PENDULA, "sweep", "attach", db], capture_output=True, text=True, timeout=300)
        assert attach.returncode == 0, attach
        say("attach: " + attach.stdout.strip().splitlines()[0], since)
        assert rows(db) == rows(local), "the results differ from those of the local sweep"
        assert len(rows(db)) == RUNS
        say("%d rows, each once, the same bits as here" % RUNS, since)
        again = subprocess.run([PENDULA, "sweep", "status", db], capture_output=True, text=True)
        assert "%d of %d runs finished" % (RUNS, RUNS) in again.stdout, again
        result = subprocess.run([PENDULA, script(folder, "cluster.lua", more=on)], capture_output=True, text=True)
        assert "finished %d" % RUNS in result.stdout, result
        say("the script again: nothing is left to do", since)
    except BaseException:
        for name in ("slurmctld.log", "slurmctld.out", "n1.out"):
            if os.path.exists(folder + "/" + name):
                with open(folder + "/" + name) as file:
                    print(name, *file.read().splitlines()[-15:], sep="\n  ", file=sys.stderr)
        raise
    finally:
        if slurm:
            slurm.end()
        shutil.rmtree(folder, ignore_errors=True)


main()
