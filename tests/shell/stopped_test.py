"""Children that were stopped (SIGSTOP), a debugger's or an administrator's, hold nothing up: Ctrl-C comes back, a parent that
ends takes them with it, and work whose parent or children go on again (SIGCONT) has the results it would have had."""
import os
import signal
import subprocess
import tempfile
import time

import pexpect

PROGRAM = os.environ["PENDULA"]
work = tempfile.mkdtemp(prefix="pendula-stopped-")
endless = "function(i) while i > 0 do end end"
# Work in each of the three kinds of children: of sweeps, of long decompositions, of safe mode.
CHILDREN = {
    "parallel_calls": ([PROGRAM, "-e", f"io.write 'go\\n' io.flush() parallel_calls(8, {endless}, {{ workers = 3 }})"], 3),
    "sweep": ([PROGRAM, "-e", "x, r, k = var 'x', input 'r', param('k', 1) io.write 'go\\n' io.flush() "
               "sweep(dae{ der(x) ~ r - k*x }, { start = { x = 1 }, to = 1, params = { k = { 1, 2, 3, 4 } }, workers = 2, "
               "limit = 100, inputs = { [r] = function(time) while time > 0.3 do end return 0 end } })"], 2),
    "eig": ([PROGRAM, "-e", "m = randn(900, 900) "
             "io.write 'go\\n' io.flush() print(#eig(m))"], 1),
    "safe": ([PROGRAM, "--safe", "endless.lua", "--time", "100s"], 1),
}
with open(os.path.join(work, "endless.lua"), "w") as file:
    file.write("io.write 'go\\n' io.flush() while true do end")


def children_of(pid):
    with open(f"/proc/{pid}/task/{pid}/children") as file:
        return [int(word) for word in file.read().split()]


def fields_of(pid):
    """State, parent, … of /proc/…/stat."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return ["gone"]


def state_of(pid):
    return fields_of(pid)[0]


def is_at_work(pid):
    """It has had some processor time: what it does at its very beginning is done."""
    return sum(map(int, fields_of(pid)[11:13])) > 2


def wait_until(true, what, seconds=20):
    begin = time.time()
    while not true():
        assert time.time() - begin < seconds, what
        time.sleep(0.01)


def stopped(command, number):
    """The process and its children, all of which are stopped."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=work)
    process.stdout.readline()
    wait_until(lambda: len(children_of(process.pid)) >= number, f"{number} children of {command}")
    children = children_of(process.pid)
    wait_until(lambda: all(map(is_at_work, children)), f"children of {command} at work")
    for child in children:
        os.kill(child, signal.SIGSTOP)
    wait_until(lambda: all(state_of(child) == "T" for child in children), "stopped children")
    return process, children


for name, (command, number) in CHILDREN.items():
    for sent, status in ((signal.SIGINT, 130), (signal.SIGTERM, -signal.SIGTERM), (signal.SIGKILL, -signal.SIGKILL)):
        process, children = stopped(command, number)
        process.send_signal(sent)
        begin = time.time()
        _, errors = process.communicate(timeout=20)
        assert process.returncode == status, (name, sent, process.returncode, errors)
        wait_until(lambda: all(state_of(child) == "gone" for child in children), (name, sent, "children are left"))
        print(f"{name}: {sent.name} after {time.time() - begin:.1f} s")

# At the prompt: what is done is the result, and the session goes on.
environment = {"HOME": work, "PATH": os.environ["PATH"], "TERM": "dumb", "LC_ALL": "C.UTF-8", "NO_COLOR": "1"}
session = pexpect.spawn(PROGRAM, ["-i"], env=environment, encoding="utf-8", timeout=30, echo=False, cwd=work)
session.sendline("function late(i) while i > 4 do end return i^2 end")
session.sendline("list, failures, left = parallel_calls(8, late, { workers = 2 })")
wait_until(lambda: len(children_of(session.pid)) == 2, "workers of a session")
wait_until(lambda: all(map(is_at_work, children_of(session.pid))), "workers at work")
for child in children_of(session.pid):
    os.kill(child, signal.SIGSTOP)
session.sendintr()
session.expect("interrupted; the calls that are done are the result")
session.sendline('print("<", list[4], list[5], #failures, left, ">")')
session.expect(r"<\s+16.0\s+false\s+0\s+4\s+>")
session.sendline('print("<", #parallel_calls(5, function(i) return i end, { workers = 2 }), ">")')
session.expect(r"<\s+5\s+>")
session.expect("> ")  # Ctrl-D before the prompt stands would be lost
session.sendeof()
session.expect(pexpect.EOF)

# A pause changes nothing: children stopped and told to go on, then the parent.
for who in ("children", "parent"):
    code = ("io.write 'go\\n' io.flush() function heavy(i) local s = 0 for k = 1, 1e7 do s = s + i/k end return s end "
            "list, failures = parallel_calls(4, heavy, { workers = 2 }) print(#failures, ('%.6f'):format(list[4]))")
    process, children = stopped([PROGRAM, "-e", code], 2)
    if who == "parent":
        process.send_signal(signal.SIGSTOP)
        wait_until(lambda: state_of(process.pid) == "T", "a stopped parent")
    for pid in children + [process.pid]:
        os.kill(pid, signal.SIGCONT)
    output, errors = process.communicate(timeout=60)
    assert output.split() == ["0", "66.781245"], (who, output, errors)
