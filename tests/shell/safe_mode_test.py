"""pendula --safe: scripts that try to get out, and what is said of them."""
import json
import os
import pty
import socket
import subprocess
import tempfile

PROGRAM = os.environ["PENDULA"]
work = tempfile.mkdtemp(prefix="pendula-safe-")
folder = os.path.join(work, "folder")
os.mkdir(folder)
secret = os.path.join(work, "secret.txt")
with open(secret, "w") as file:
    file.write("SECRET")
os.symlink(secret, os.path.join(folder, "link.txt"))
count = 0
sanitized = "PENDULA_SANITIZED" in os.environ  # memory is then not limited, and leaks cannot be sought behind the walls
if sanitized:
    os.environ["ASAN_OPTIONS"] += ":detect_leaks=0"


def safe(code, *options, status=None, outcome=None, contains=None, call=None, seconds="5s", memory="400M"):
    """Runs code; checks status, outcome, a piece of the message or output, a refused call."""
    global count
    count += 1
    command = [PROGRAM, "--safe", "--json", "--time", seconds, "--memory", memory, *options, "-e", code]
    environment = dict(os.environ, SECRET_NAME="SECRET")
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)
    report = json.loads(done.stdout)
    where = f"{code}\n{report}\n{done.stderr}"
    assert done.returncode == report["status"], where
    assert outcome is None or report["outcome"] == outcome, where
    assert status is None or done.returncode == status, where
    words = (report["message"] or "") + report["output"] + report["errors"]
    assert contains is None or contains in words, where
    assert call is None or any(call in name for name in report["forbidden"]), where
    assert "SECRET" not in report["output"] + report["errors"], where
    return report


# ── what is allowed ──
report = safe("local x = var 'x' print(dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }(x, 1))", status=0,
              outcome="finished", contains="0.367879")
assert report["forbidden"] == [] and report["memory_bytes"] > 1e6 and report["cpu_seconds"] > 0
safe("plot({ 1, 2 }):show() print(os.date '%Y', os.clock(), os.time())", status=0)
safe("""local k, x = param('k', 1), var 'x'
  print(#sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = { 1, 2, 3 } } }))""",
     outcome="finished", contains="3")
safe("local x = var 'x' save('a.lua', x) print(load 'a.lua', io.open('a.lua'):read 'a') os.rename('a.lua', 'b.lua')",
     "--folder", folder, outcome="finished")
assert os.listdir(folder).count("b.lua") == 1
safe("print(debug, os.getenv 'SECRET_NAME', os.getenv 'HOME')", outcome="error", contains="debug")
safe("print(rawget(_G, 'debug'), package.loaded.debug, os.getenv 'SECRET_NAME', os.getenv 'HOME', io.read 'a')",
     outcome="finished", contains="nil nil nil nil")

# ── processes ──
for code, call in (("os.execute 'touch /tmp/x'", "os.execute"), ("io.popen 'ls'", "io.popen"),
                   ("pcall(os.execute, 'ls') print 'went on'", "os.execute"),
                   ("coroutine.wrap(function() pcall(io.popen, 'ls') end)()", "io.popen")):
    safe(code, status=3, outcome="forbidden", call=call)
safe("plot({ 1, 2 }):save 'a.svg'", "--folder", folder, status=1, contains="gnuplot could not be started")
safe("""local x = var 'x'
  sweep(dae{ der(x) ~ -param('k', 1)*x }, { start = { x = 1 }, to = 1, workers = 3, lanes = 1, params = { k = linspace(1, 2, 40) } })""",
     outcome="finished")

# ── files ──
for name in (secret, "/etc/passwd", "/proc/self/environ", "/proc/self/mem", "/proc/1/cmdline", "/dev/fd/3", "/dev/tty",
             os.path.join(folder, "..", "secret.txt"), "../secret.txt", "link.txt", "/proc/self/root/etc/passwd"):
    for options in ((), ("--folder", folder)):
        report = safe(f"""local name = '{name}'
          local opened = io.open(name)
          if opened then print('OPENED', opened:read 'a') end
          for _, f in ipairs {{ io.lines, io.input, dofile, iddata.read,
            function(file) return assert(loadfile(file)) end,
            function(file) return assert(io.open(file, 'w')) end }} do
            if pcall(f, name, f == iddata.read and {{ y = 1, Ts = 1 }} or nil) then print('OPENED', f) end
          end""", *options)
        assert "OPENED" not in report["output"], report
safe(f"io.open '{secret}'", status=3, call="io.open")
for name in ("io.lines", "io.input", "io.output", "dofile"):
    safe(f"pcall({name}, '{secret}')", status=3, call=name)
for code in (f"assert(io.open('{work}/new', 'w'))", f"save('{work}/new.lua', var 'x')", f"os.remove '{secret}'",
             f"os.rename('b.lua', '{work}/new')", f"os.rename('{secret}', 'c.lua')", f"io.output '{work}/new'",
             "os.tmpname()", "io.tmpfile()", "assert(io.open('link.txt', 'w')):write 'gone'"):
    report = safe(code, "--folder", folder)
    assert report["outcome"] in ("forbidden", "error"), (code, report)
assert sorted(os.listdir(work)) == ["folder", "secret.txt"] and open(secret).read() == "SECRET"
assert not [name for name in os.listdir(folder) if "draft" in name], os.listdir(folder)
# A disk is not filled by one file.
safe("local f = io.open('big', 'w') for _ = 1, 200 do assert(f:write(('x'):rep(1e6))) end", "--folder", folder,
     outcome="error", contains="File too large")
os.remove(os.path.join(folder, "big"))

# ── the network: nothing in Lua reaches it; the filter is asked directly ──
listener = socket.socket()
listener.bind(("127.0.0.1", 0))
safe("require 'socket'", outcome="error", contains="not found")
safe("package.loadlib('libc.so.6', 'socket')", outcome="error")
listener.close()

# ── bytecode and the doors of Lua itself ──
safe("print(load('\\27Lua'))", contains="binary chunk")
safe("string.dump(print)", outcome="error")
safe("load(string.dump(function() end), 'x', 'b')", outcome="error")
safe("load('x', 'x', 'b')", outcome="error", contains="bytecode")
for code in ("getmetatable(var 'x').__index = 1", "getmetatable('').__index.rep = nil ('x'):rep(2)",
             "package.searchers[3]()", "package.cpath = '/lib/?.so' require 'liblua5.4'",
             "require 'debug'.getregistry()"):
    assert safe(code)["outcome"] in ("error", "finished", "forbidden")

# ── time ──
for code in ("while true do end", "string.find(('a'):rep(100), ('a*'):rep(40) .. 'b')", "while pcall(error) or true do end",
             "setmetatable({}, { __gc = function() while true do end end })", "table.move({}, 1, 1e15, 2)",
             "local function f() return pcall(f) end while true do f() end",
             "coroutine.wrap(function() while true do end end)()", "expand((var 'x' + var 'y' + var 'z' + 1)^200)",
             "local t = setmetatable({}, { __close = function() while true do end end }) do local c <close> = t end"):
    report = safe(code, seconds="150ms", memory="2G", status=4, outcome="time")
    assert report["cpu_seconds"] < 2, report

# ── memory and output ──
for code in ("local t = {} while true do t[#t + 1] = {} end", "local s = 'x' while true do s = s .. s end",
             "('x'):rep(1e10)", "local t = {} for i = 1, 1e9 do t[i] = zeros(1000, 1000) end",
             "string.rep('x', -1 >> 1)", "local x = var 'x' local e = x for i = 1, 1e9 do e = e*(x + i) + i/7 end"):
    report = safe(code, memory="150M", seconds="2s" if sanitized else "20s")
    assert report["outcome"] in ("memory", "error", "time") and (sanitized or report["memory_bytes"] < 1 << 30), report
safe("while true do print(('x'):rep(1e6)) end", status=6, outcome="output", seconds="20s")
report = safe("local function f() return 1 + f() end f()", outcome="error", contains="stack overflow")
assert report["line"] == 1

# ── what is said ──
report = safe("\n\nerror 'own words'", status=1, outcome="error", contains="own words")
assert report["line"] == 3
safe("os.exit(3)", status=1, outcome="error", contains="os.exit with status 3")
safe("os.exit(0)", status=0)
safe("print '\\xff\\0\\1\"\\\\'", status=0)
safe("x = = 1", status=1, contains="unexpected symbol")


# FLINT is a library that is opened when it is needed: before the walls stand.
safe("local x = var 'x' print(#solve(x^2 + 3*x + 2, x), factor(x^2 - 1))", status=0)


def plain(*arguments, status, text=None):
    done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL)
    assert done.returncode == status, (arguments, done)
    assert text is None or text in done.stdout + done.stderr, (arguments, done)


script = os.path.join(work, "script.lua")
with open(script, "w") as file:
    file.write("print('arguments', arg[0] ~= nil, ...)\n")
plain("--safe", script, "--time", "2s", "--", "--json", status=0, text="arguments true --json")
plain("--safe", script, "one", "two", status=0, text="one two")
plain("--safe", script, "--time", "2 parsec", status=2, text="unknown unit")
plain("--safe", script, "--time", "soon", status=2, text="write it as in --time 10s")
plain("--safe", script, "--memory", "-1G", status=2, text="write it as in --memory 1G")
plain("--safe", script, "--memory", "5Q", status=2, text="K, M and G are known")
for time, memory in (("5000ms", "400MiB"), ("0.5min", "400000K"), ("30", "400000000")):
    safe("print(1)", status=0, outcome="finished", seconds=time, memory=memory)
plain("--safe", script, "--time", "-1s", status=2, text="not understood")
plain("--safe", script, "--memory", status=2, text="needs a value")
plain("--safe", script, "--folder", os.path.join(work, "none"), status=1, text="cannot be entered")
plain("--safe", os.path.join(work, "none.lua"), status=1, text="cannot read")
plain("--safe", status=2, text="needs a script")
plain("--json", script, status=2, text="--safe")
plain("--safe", "-i", script, status=2, text="exclude")
plain("--safe", "-e", "os.execute 'ls'", status=3, text="-e:1: os.execute is forbidden")


def at_terminal(code):
    """What a terminal is sent."""
    terminal, inside = pty.openpty()
    with subprocess.Popen([PROGRAM, "--safe", "-e", code], stdin=subprocess.DEVNULL, stdout=inside, stderr=inside,
                          env=dict(os.environ, NO_COLOR="1")) as child:
        os.close(inside)
        sent = b""
        while True:
            try:
                piece = os.read(terminal, 4096)
            except OSError:
                break
            if not piece:
                break
            sent += piece
        child.wait()
    os.close(terminal)
    return sent.replace(b"\r\n", b"\n")


# A terminal does not obey a script: titles, clipboards, answers to questions, lines written over, text turned around.
sent = at_terminal(r"print('\27]0;title\7\27[2J\rover\127\u{9b}31m\u{202E}txt', 'häßlich\tθ′', '\xff')")
assert sent == r"\27]0;title\7\27[2J\13over\127\u{9B}31m\u{202E}txt".encode() + " häßlich\tθ′ ".encode() + b"\\xFF\n", sent
sent = at_terminal(r"io.write('θ' .. ('ω'):rep(40000), '\xce') io.stderr:write '\27[31m' error '\27[2J'")
assert sent.count("ω".encode()) == 40000 and b"\\xCE" in sent and rb"\27[31m" in sent and rb"\27[2J" in sent and b"\x1b" not in sent, sent[-200:]

# No process is left, whatever was killed.
left = subprocess.run(["pgrep", "-P", str(os.getpid())], capture_output=True, text=True).stdout.split()
assert len(left) <= 1, left  # pgrep itself
print(f"{count} scripts confined")
