# string.find, match, gsub and gmatch give what Lua's own give, for random patterns, malformed ones included; and
# Ctrl-C stops a pattern that would take years.
import os
import signal
import subprocess
import sys
import time

program = os.environ.get("PENDULA", "build/release/pendula")
script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "pattern_results.lua")
failed = 0


def results(command):
    return subprocess.run([command, script, "6000"], capture_output=True, env={**os.environ, "LC_ALL": "C"}).stdout.split(b"\n")


theirs, ours = results("lua5.4"), results(program)
for a, b in zip(theirs, ours):
    if a != b:
        print("lua5.4 ", a, "\npendula", b)
        failed = 1
        break
if len(theirs) != len(ours) or len(ours) < 6000:
    print(f"lua5.4 has {len(theirs)} results, pendula {len(ours)}")
    failed = 1

slow = {
    "find": "s:find('.-.-.-.-b')",
    "match": "s:match('(.-)(.-)(.-)b')",
    "gsub": "s:gsub('.-.-.-b', 'x')",
    "gmatch": "for _ in s:gmatch('.-.-.-b') do end",
    "pcall": "pcall(string.find, s, '.-.-.-.-b')",
    "expm": "local a = {} for i = 1, 60 do a[i] = {} for j = 1, 60 do a[i][j] = (i*37 + j*53 + i*j) % 7 end end expm(mat(a))",
    "inv": "local a = {} for i = 1, 160 do a[i] = {} for j = 1, 160 do a[i][j] = (i*37 + j*53 + i*i*j) % 1009 end end inv(mat(a))",
    "finalizer": "setmetatable({}, { __gc = function() while true do end end }) while true do local t = {} end",
    "der": "local x = var 'x' der(sin(x)*exp(x^2)*cos(x^3), 100)",
}
for name, code in slow.items():
    run = subprocess.Popen([program, "-e", "s = ('a'):rep(30000) print 'go' io.stdout:flush() " + code],
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    run.stdout.readline()
    time.sleep(0.3)
    run.send_signal(signal.SIGINT)
    begun = time.monotonic()
    try:
        _, said = run.communicate(timeout=20)
        if run.returncode != 130 or b"interrupted" not in said:
            print(f"{name}: status {run.returncode}, {said}")
            failed = 1
    except subprocess.TimeoutExpired:
        run.kill()
        print(f"{name}: not interrupted within 20 s")
        failed = 1
sys.exit(failed)
