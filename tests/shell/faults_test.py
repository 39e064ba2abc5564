"""Signals at random moments, full disks, little memory: a clear end, whole files, nothing left behind."""
import os
import random
import signal
import subprocess
import tempfile
import time

PROGRAM = os.environ["PENDULA"]
work = tempfile.mkdtemp(prefix="pendula-faults-")
random.seed(5)


def start(code, **more):
    return subprocess.Popen([PROGRAM, "-e", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=work,
                            **more)


def interrupted(code, sent=signal.SIGINT):
    """The exit status of a run that is signalled at a random moment after it said 'go'; it must end soon."""
    process = start("io.write 'go\\n' io.flush() " + code)
    process.stdout.readline()
    time.sleep(random.uniform(0, 0.2))
    process.send_signal(sent)
    begin = time.time()
    try:
        _, errors = process.communicate(timeout=10)
    except subprocess.TimeoutExpired:
        process.kill()
        raise AssertionError(f"no end: {code}")
    assert time.time() - begin < 5, (code, time.time() - begin)
    return process.returncode, errors


long_work = (
    "local t = {} for i = 1, 1e6 do t[i] = math.random() end while true do table.sort(t) t[1], t[9] = 2, 3 end",
    "while true do string.rep('ab', 1e8) end",
    "table.move({}, 1, 1e15, 2)",
    "string.find(('a'):rep(100), ('a*'):rep(40) .. 'b')",
    "setmetatable({}, { __gc = function() while true do end end }) while true do collectgarbage() end",
    "local s = ('x'):rep(1e8) while true do s:upper() s:reverse() end",
    "expand((var 'x' + var 'y' + var 'z' + 1)^100)",
    "local x = var 'x' while true do dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 100, rtol = 1e-12 } end",
    "local e = var 'x' for i = 1, 20000 do e = sin(e) end dae{ der(var 'x') ~ e }:index()",
    "coroutine.wrap(function() while true do pcall(error) end end)()",
    "io.open('/dev/zero'):read 'a'",
    "while true do io.open('/dev/zero'):read(10^9) end",
    "io.open('/dev/zero'):read 'l'",
    "for line in io.lines '/dev/zero' do end",
    "io.input '/dev/zero' io.read 'L'",
)
for code in long_work:
    status, errors = interrupted(code)
    assert status == 130 and "interrupted" in errors, (code, status, errors)
for sent in (signal.SIGTERM, signal.SIGHUP):
    status, _ = interrupted("while true do end", sent)
    assert status == -sent, status


def state_of(process):
    with open(f"/proc/{process.pid}/stat") as file:
        return file.read().rpartition(")")[2].split()[0]


# A write that waits for a reader who does not read.
for code in ("print(('x'):rep(1e7))", "io.write(('x'):rep(1e7))", "io.stdout:write(1, ('x'):rep(1e7))",
             "while true do print 'x' end", "while true do help 'integrate' end"):
    process = start(code)
    asleep = 0
    while asleep < 5:  # in its write
        asleep = asleep + 1 if state_of(process) == "S" else 0
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=10) == 130, (code, process.returncode)
    process.stdout.close()
    process.stderr.close()
done = subprocess.run([PROGRAM, "-e", """local f, part = io.tmpfile(), ('ab'):rep(5000)
print(f:write(part, 3, part) == f, f:seek 'set', f:read 'a' == part .. '3' .. part)
print(select('#', io.write(('z'):rep(5000), '\\n')), pcall(io.write, ('z'):rep(5000), {}))"""],
                      capture_output=True, text=True, cwd=work)
assert done.stdout == ("true 0 true\n" + "z" * 5000 + "\n" + "z" * 5000
                       + "1 false bad argument #2 to 'io.write' (string expected, got table)\n"), done

# What was read before is read as ever: lines, counts, numbers, seeking, the rest.
done = subprocess.run([PROGRAM, "-e", """local name = os.tmpname() local f = io.open(name, 'w') f:write('one\\n2.5 x\\nlast') f:close()
f = io.open(name) print(f:read('l', 'n', 1, 'L', 'a', 'l')) print(f:seek('set', 4), f:read 'n', f:close(), pcall(f.read, f))
for line in io.lines(name) do io.write(line, ';') end print(io.input(name) == io.input(), io.read 'a', io.open('/none') == nil)"""],
                      capture_output=True, text=True, cwd=work)
assert done.stdout == ("one 2.5   x\n last nil\n4 2.5 true false attempt to use a closed file\n"
                       "one;2.5 x;last;true one\n2.5 x\nlast true\n"), done

# Temporary files go with the program, however that ends, and with them what was written beside.
folder = os.path.join(work, "temporary")
os.mkdir(folder)
made = "local n = os.tmpname() local f = io.open(n .. '.svg', 'w') f:write 'x' f:close() io.write 'go\\n' io.flush() "
for ending, sent in (("", None), ("os.exit(0)", None), ("os.exit(3)", None), ("error 'x'", None),
                     ("parallel_calls(3, function(i) return os.tmpname() end)", None),
                     *[("while true do end", sent) for sent in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]):
    process = start(made + ending, env=dict(os.environ, TMPDIR=folder))
    process.stdout.readline()
    if sent:
        process.send_signal(sent)
    process.communicate(timeout=20)
    assert os.listdir(folder) == [], (ending, sent, os.listdir(folder))
process = start(made + "while true do print(1) end", env=dict(os.environ, TMPDIR=folder))
process.stdout.readline()
process.stdout.close()
process.wait(timeout=20)
assert os.listdir(folder) == [], "after SIGPIPE"
os.rmdir(folder)

# A file is the old one or the new one, and its draft goes with the process, whenever that ends.
saving = ("local x = var 'x' local long = dae{ der(x) ~ -x + expand((x + 1)^40) } save('m.lua', x) "
          "while true do save('m.lua', long) save('m.lua', x) end")
subprocess.run([PROGRAM, "-e", "save('m.lua', var 'x')"], cwd=work, check=True)
for k in range(12):
    interrupted(saving, (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)[k % 3])
    done = subprocess.run([PROGRAM, "-e", "print(load 'm.lua')"], capture_output=True, text=True, cwd=work)
    assert done.returncode == 0, done
    assert os.listdir(work) == ["m.lua"], os.listdir(work)

# Where a file of runs is expected, a pipe is refused and not waited for.
os.mkfifo(os.path.join(work, "pipe.db"))
for name in ("attach", "load"):
    done = subprocess.run([PROGRAM, "-e", f"{name} 'pipe.db'"], capture_output=True, text=True, cwd=work, timeout=60)
    assert done.returncode == 1 and f"{name}: cannot open 'pipe.db': it is a folder, a pipe" in done.stderr, done
os.remove(os.path.join(work, "pipe.db"))

# Disks and pipes.
for code in ("save('/dev/full', var 'x')", "iddata{ y = { 1, 2 }, Ts = 1 }:csv '/dev/full'",
             "dae{ der(var 'x') ~ 1 }:integrate{ start = { x = 1 }, to = 1 }:csv '/dev/full'"):
    done = subprocess.run([PROGRAM, "-e", code], capture_output=True, text=True)
    assert done.returncode == 1 and "No space left" in done.stderr, (code, done)
with open("/dev/full", "w") as full:
    done = subprocess.run([PROGRAM, "-e", "print(('x'):rep(1e5))"], stdout=full, stderr=subprocess.PIPE, text=True)
assert done.returncode == 1 and "standard output" in done.stderr, done
done = subprocess.run(f"ulimit -f 0; {PROGRAM} -e \"save('{work}/limit.lua', 1)\"", shell=True, capture_output=True, text=True)
assert done.returncode == 1 and "too large" in done.stderr.lower(), done
done = subprocess.run(f"{PROGRAM} -e 'for i = 1, 1e6 do print(i) end' | head -1", shell=True, capture_output=True, text=True)
assert done.stdout == "1\n" and done.stderr == "", done

# Little memory, a small stack.
for limit, code in (("ulimit -v 600000", "local t = {} while true do t[#t + 1] = {} end"),
                    ("ulimit -v 600000", "local s = 'x' while true do s = s .. s end"),
                    ("ulimit -v 600000", "local t = {} for i = 1, 1e9 do t[i] = zeros(1000, 1000) end"),
                    ("ulimit -s 256", "local function f() return 1 + f() end f()"),
                    ("ulimit -s 256", "print(load(('('):rep(190) .. '1' .. (')'):rep(190)))")):
    if "PENDULA_SANITIZED" in os.environ and "-v" in limit:
        continue  # the address sanitizer reserves terabytes of addresses
    done = subprocess.run(["bash", "-c", f"{limit}; exec {PROGRAM} -e \"$0\"", code], capture_output=True, text=True, timeout=60)
    assert done.returncode in (0, 1), (limit, code, done)
    assert done.returncode == 0 or "memory" in done.stderr or "stack overflow" in done.stderr, (limit, code, done)
print("faults survived")
