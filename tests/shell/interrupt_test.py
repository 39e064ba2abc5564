"""Ctrl-C at random moments of long work in one session: the prompt comes back, nothing is lost, and the next result is what
it was before. interrupt_test.py 10000 is the campaign; it prints the longest wait."""
import os
import random
import sys
import time

import pexpect

PROGRAM = os.environ["PENDULA"]
rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 42
patience = float(os.environ.get("PENDULA_PATIENCE", "30"))
random.seed(rounds)

SETUP = """x, y, z, v, k, g = var "x", var "y", var "z", var "v", param("k", 1), param("g", 9.81)
fall = dae{ der(x) ~ v, der(v) ~ -k*x }
ring = dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - g, 0 ~ x^2 + y^2 - 1 }
d = iddata{ y = vec(table.pack((function(n) local l = {} for i = 1, n do l[i] = math.sin(0.3*i) + 0.1*math.cos(i*i) end return table.unpack(l) end)(200))), Ts = 1 }
rows = {} for i = 1, 500 do rows[i] = {} for j = 1, 500 do rows[i][j] = math.sin(i*i + 3*j) end end large = evaluate(mat(rows))
function probe() local s = ring:reduce():integrate{ start = { x = 1, y = 0, [der(x)] = 0, [der(y)] = 0 }, to = 0.5 } return ("%.9f %d"):format(s:final(y), ring:index()) end"""

WORK = (
    'fall:integrate{ start = { x = 1, v = 0 }, to = 1e7 }',
    'ring:reduce():integrate{ start = { x = 1, y = 0, [der(x)] = 0, [der(y)] = 0 }, to = 1e6, method = "radau" }',
    'fall:integrate{ start = { x = 1, v = 0 }, to = 1e6, method = "bdf", rtol = 1e-10 }',
    'while true do dae{ der(x) ~ -x*rand() }:index() end',
    'while true do ring:reduce() end',
    'expand((x + y + z + 1)^90)',
    'for i = 1, 1e9 do simplify(sin(x)^2 + cos(x)^2 + i) end',
    'sweep(fall, { start = { x = 1, v = 0 }, to = 300, params = { k = normal(1, 0.1) }, runs = 100000 })',
    'parallel_calls(1000, function(i) local s = 0 for j = 1, 1e8 do s = s + j end return s end)',
    'while true do arx(d, { na = 8, order = 8 }) end',
    'while true do fit(fall, { params = { k }, data = d, y = x, start = { x = 1, v = 0 } }) end',
    'local t = {} for i = 1, 3e6 do t[i] = math.random() end while true do table.sort(t) t[1] = 2 end',
    'string.find(("a"):rep(100), ("a*"):rep(40) .. "b")',
    'while true do factor(expand((x + 1)^20*(y - 2)^10)) end',
    'while true do eig(mat{{1, 2, 3}, {4, 5, 6}, {7, 8, 10}}) end',
    'while true do eig(large) end',
    'while true do lqr(large, eye(500), eye(500), eye(500)) end',
    'while true do minreal(ss(large, ones(500), ones(1, 500), {{0}})) end',
    'while true do place(large, eye(500), linspace(-1, -2, 500)) end',
    'local file = os.tmpname() while true do save(file, large) end',
    'local e = x for i = 1, 3000 do e = sin(e) end while true do dae{ der(x) ~ e }:structure() end',
    'while true do plot(fall:integrate{ start = { x = 1, v = 0 }, to = 50 }, x) end',
)

folder = os.environ.get("TMPDIR", "/tmp")
environment = {"HOME": folder, "PATH": os.environ["PATH"], "TERM": "dumb", "LC_ALL": "C.UTF-8", "NO_COLOR": "1"}
session = pexpect.spawn(PROGRAM, ["-i"], env=environment, encoding="utf-8", timeout=patience, echo=False, cwd=folder)
for line in SETUP.splitlines():
    session.sendline(line)
session.sendline('print("<" .. probe() .. ">")')
session.expect(r"<([-0-9. ]+)>")
expected = session.match.group(1)

waits = []
for i in range(rounds):
    work = WORK[i % len(WORK)]
    session.sendline(f'print("be" .. "gin{i}") {work}')
    session.expect(f"begin{i}\\D")
    time.sleep(random.random() ** 2 * 0.3)
    session.sendintr()
    sent = time.time()
    session.sendline(f'print("<{i}:" .. probe() .. ">")')
    session.expect(f"<{i}:([-0-9. ]+)>")
    waits.append((time.time() - sent, work))
    assert session.match.group(1) == expected, (work, session.match.group(1), expected)

# A part that is kept is stored or drawn; no loop and no further computation goes on with it.
part = "fall:integrate{ start = { x = 1, v = 0 }, to = 1e7 }"
for work, told in ((f"sol = {part}", "sol.t[#sol.t] > 0"), (f"do sol = {part}", "sol.t[#sol.t] > 0"),
                   (f"first = {part} second = {part}", 'first and rawget(_G, "second") == nil'),
                   (f"fig = plot({part}, x)", 'tostring(fig) ~= "nil"'),
                   (f"n = 0 while true do n = n + 1 sol = {part}", "n == 1")):
    end = "\nend" if " do " in work or work.startswith("do") else ""
    session.sendline(f'print("be" .. "gin") {work}{end}')
    session.expect("begin\\D")
    time.sleep(0.5)
    session.sendintr()
    session.expect("the part computed so far is the result")
    session.sendline(f'print("<" .. tostring({told}) .. ">")')
    session.expect("<(true|false)>")
    assert session.match.group(1) == "true", work
session.expect("> ")  # Ctrl-D before the prompt stands would be lost
session.sendeof()
session.expect(pexpect.EOF)
longest = max(waits)
print(f"{rounds} interrupts, longest wait {longest[0]:.2f} s ({longest[1][:60]})")
