"""Ctrl-C at random moments of long work in one session: the prompt comes back, nothing is lost, and the next result is what
it was before. interrupt_test.py 10000 is the campaign: it prints the longest wait, and every kind of work that has come back
later than after PENDULA_LATE seconds (0.3), with how often and how late."""
import os
import random
import sys
import time

import pexpect

PROGRAM = os.environ["PENDULA"]
rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 42
patience = float(os.environ.get("PENDULA_PATIENCE", "30"))
late = float(os.environ.get("PENDULA_LATE", "0.3"))
random.seed(rounds)

SETUP = """x, y, z, v, k, g = var "x", var "y", var "z", var "v", param("k", 1), param("g", 9.81)
fall = dae{ der(x) ~ v, der(v) ~ -k*x }
ring = dae{ der(x, 2) ~ -z*x, der(y, 2) ~ -z*y - g, 0 ~ x^2 + y^2 - 1 }
d = iddata{ y = (function(l) for i = 1, 200 do l[i] = math.sin(0.3*i) + 0.1*math.cos(i*i) end return vec(l) end)({}), Ts = 1 }
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
    'local e = x for i = 1, 60000 do e = sin(e) end local d = diff(e, x) while true do tostring(d) end',
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
    'fall:integrate{ start = { x = 1, v = 0 }, to = 1e6, method = "rodas" }',
    'fall:integrate{ start = { x = 1, v = 0 }, to = 1e6, method = "gauss" }',
    'fall:integrate{ start = { x = 1, v = 0 }, to = 1e6, method = rk.rk4, dt = 1e-3 }',
    'fall:integrate{ start = { x = 1, v = 0 }, to = 1e6, events = { { when = x, call = function() end } } }',
    'while true do fall:integrate{ start = { x = 1, v = 0 }, to = 100 }:check() end',
    'while true do fall:integrate{ start = { x = 1, v = 0 }, to = 100 }:gradient(x, { k }) end',
    'while true do fall:integrate{ start = { x = 1, v = 0 }, to = 100, sensitivities = { k } }:sensitivity(x, { k }) end',
    'sweep(fall, { start = { x = 1, v = 0 }, to = 300, params = { k = normal(1, 0.1) }, runs = 100000, workers = 1 })',
    'sweep(fall, { start = { x = 1, v = 0 }, to = 1e5, params = { k = normal(1, 0.1) }, runs = 1000, method = "radau" })',
    'while true do ring:init{ guess = { x = math.random(), y = math.random() } } end',
    'while true do ring:reduce "array" end',
    'while true do ring:reduce "ggl":structure() end',
    'local e = x for i = 1, 2000 do e = sin(e) + x end while true do e:code() e:latex() tostring(e) end',
    'local e = x for i = 1, 300 do e = sin(e)*x end while true do der(e, 3) end',
    'local e = x for i = 1, 500 do e = sin(e) + x end dae{ der(x) ~ -e }:structure()',
    'inv(evaluate(large)*large)',
    'det(mat((function() local m = {} for i = 1, 60 do m[i] = {} for j = 1, 60 do m[i][j] = rational(i + 2*j, j*j + i) end end return m end)()))',
    'while true do n4sid(d, 6) end',
    'while true do armax(d, { na = 6, nc = 6 }) end',
    'while true do order_scan(d, { na = {1, 12} }) end',
    'while true do solve_equations({ x^4 - y ~ 1, y^3 + x*y ~ 2 }, { x, y }) end',
    'while true do laplace_transform(t^8*exp(-t)*sin(3*t)) end',
    'while true do integral(x^6*exp(x)*sin(x), x) end',
    'while true do tf({ 1 }, { 1, 2, 3, 4, 5, 6 }):bode() end',
    'local s = {} for i = 1, 1e9 do s[i % 1000 + 1] = ("x"):rep(1000) .. i end',
    'local n = 0 while true do n = n + #randn(1000, 100) end',
    'local f = fn(x, sin(x)*exp(x)) while true do f(linspace(0, 1, 1000000)) end',
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
    session.sendline(f'print("ba" .. "ck{i}")')
    session.expect(f"back{i}\\D")
    waits.append((time.time() - sent, work))
    session.sendline(f'print("<{i}:" .. probe() .. ">")')
    session.expect(f"<{i}:([-0-9. ]+)>")
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
for work in dict.fromkeys(work for wait, work in sorted(waits, reverse=True) if wait > late):
    found = sorted(wait for wait, of in waits if of == work)
    above = sum(wait > late for wait in found)
    print(f"  {above} of {len(found)} came back after more than {late} s, the last after {found[-1]:.2f} s: {work[:100]}")
print(f"{rounds} interrupts of {len(WORK)} kinds of work, {sum(wait > late for wait, _ in waits)} of more than {late} s, longest wait {longest[0]:.2f} s ({longest[1][:60]})")
