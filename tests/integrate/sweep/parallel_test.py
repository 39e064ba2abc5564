# Ctrl-C at the prompt keeps what worker processes have done; one that is killed costs one run.
import os, re, subprocess, tempfile, time

import pexpect

pendula = os.environ["PENDULA"]
folder = tempfile.mkdtemp(prefix="pendula_parallel_")

SETUP = """x, r, k = var "x", input "r", param("k", 1)
decay = dae{ der(x) ~ -k*x }
driven = dae{ der(x) ~ -x + r }
function pause(seconds) local ends = os.time() + seconds while os.time() < ends do end end
function slow_after(n) return function(i) if i > n then pause(60) end return i^2 end end
u, y = {}, {} for i = 1, 4000 do u[i] = math.sin(i^1.3) y[i] = math.sin(i*i) + (u[i - 3] or 0) end
data = iddata{ y = y, u = u, Ts = 1 }
samples = {} for i = 1, 41 do samples[i] = 2*math.exp(-0.05*(i - 1)) + 0.02*math.sin(37*i) end
fitted = fit(decay, { params = { k, x }, data = iddata{ y = samples, Ts = 0.1 }, y = x, guess = { k = 0.5 } })
slow = { [r] = function(time) if math.abs(time - 0.0125) < 1e-6 then pause(60) end return 0 end }"""

# What is typed, and what is asked about its result, with the answer.
INTERRUPTED = (
    ("list, failures, left = parallel_calls(8, slow_after(3), { workers = 2 })",
     "list[3], list[8], #failures, left", "9.0 false 0 5"),
    ("c = converge(driven, { start = { x = 1 }, to = 1, methods = { rk.heun }, inputs = slow, exact = exp(-t), "
     "dt = { 0.1, 0.05, 0.0125 }, workers = 2 })",
     'c.steps[1][1], c.steps[1][3], tostring(c):match "[12] runs? w[ae][sr]e? not made" ~= nil', "10 false true"),
    ("s = order_scan(data, { na = { 1, 40 }, nb = { 1, 40 }, nk = { 1, 40 } })",
     'tostring(s):match "interrupted: %d+ models? w[ae][sr]e? not made" ~= nil, #s > 3 and #s < 64000', "true true"),
    ("b = fitted:bootstrap{ runs = 1000000 }", 'tostring(b):match "not made %(interrupted%)"', "not made (interrupted)"),
)

def interrupted():
    environment = {"HOME": folder, "PATH": os.environ["PATH"], "TERM": "dumb", "LC_ALL": "C.UTF-8", "NO_COLOR": "1"}
    session = pexpect.spawn(pendula, ["-i"], env=environment, encoding="utf-8", timeout=30, echo=False, cwd=folder)
    for line in SETUP.splitlines():
        session.sendline(line)
    for i, (work, question, answer) in enumerate(INTERRUPTED):
        for wait in (0.6, 2, 6):  # a loaded machine may not have begun with the calls
            session.sendline(f'print("be" .. "gin{i}") {work}')
            session.expect(f"begin{i}\\D")
            time.sleep(wait)
            session.sendintr()
            if session.expect(["interrupted; the (calls|models) that are done are the result", "interrupted\r"]) == 0:
                break
        else:
            raise AssertionError(f"{work}: interrupted before the first call")
        session.sendline(f'print("<{i}:", {question}, ">")')
        session.expect(f"<{i}:\\s+(.*?)\\s+>\r\n")
        got = re.sub(r"\s+", " ", session.match.group(1))
        assert got == answer, (work, got, answer)
    session.expect("> ")  # Ctrl-D before the prompt stands would be lost
    session.sendeof()
    session.expect(pexpect.EOF)

def killed():
    script = folder + "/killed.lua"
    with open(script, "w") as file:
        file.write("""x, r = var "x", input "r"
driven = dae{ der(x) ~ -x + r }
deadly = { [r] = function(time)
  if math.abs(time - 0.0125) < 1e-6 then
    local parent = io.open("/proc/self/stat"):read("n")
    os.execute("kill -9 " .. parent)
  end
  return 0
end }
for workers = 2, 3 do
  c = converge(driven, { start = { x = 1 }, to = 1, methods = { rk.heun }, inputs = deadly, exact = exp(-t),
    dt = { 0.1, 0.05, 0.0125 }, workers = workers })
  print(#c.failures, c.failures[1].step, c.failures[1].why, c.slopes[1] > 1.9, c.errors[1][3] ~= c.errors[1][3])
end
""")
    result = subprocess.run([pendula, script], capture_output=True, text=True, timeout=60)
    line = "1 0.0125 its worker process ended unexpectedly (signal 9) true true"
    assert [" ".join(row.split()) for row in result.stdout.splitlines()] == [line, line], result

for test in (interrupted, killed):
    test()
    print("passed:", test.__name__)
