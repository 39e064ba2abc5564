"""What is nested too deeply for the stack is refused, with the session intact, or works: expressions of any depth, functions
that call each other, in the usual stack and in small ones."""
import os
import subprocess
import sys

PROGRAM = os.environ["PENDULA"]
SANITIZED = "PENDULA_SANITIZED" in os.environ  # frames are some times as large there, and calls as slow
REMEDY = "nested too deeply for a stack of"

NESTED = """x, y = var "x", var "y"
local function nested(f) local e = x for _ = 1, %d do e = f(e) end return e end
smooth = { nested(function(e) return sin(e) end), nested(function(e) return x*(e + 1) end),
  nested(function(e) return sqrt(e^2 + 1) end) }
deep = { nested(function(e) return -abs(e - 2) end), nested(function(e) return max(e, 1 - e/2) end),
  table.unpack(smooth) }
local function try(name, f, list)
  for i, e in ipairs(list or deep) do
    local good, message = pcall(f, e)
    if not good and not (message:find("nested too deeply for a stack of", 1, true)
      or message:find("too long for factors", 1, true) or message:find("not a rational function", 1, true)) then
      error(name .. " of " .. i .. ": " .. message, 0)
    end
  end
end
"""
WORK = (  # and how deep, since the time goes with the depth and more
    ('try("text", function(e) return #tostring(e) + #e:latex() end)', 4000),
    ('try("code", function(e) return #tostring(load("return " .. e:code())()) end)', 4000),
    ('try("compile", function(e) return fn(x, e)(0.1) end)', 50000),
    ('try("value", function(e) return evaluate(subs(e, { [x] = 0.1 })) end)', 50000),
    ('try("run", function(e) return dae{ der(x) ~ e }:integrate{ start = { x = 0.1 }, to = 1e-3, method = "radau" }.status end, smooth)', 4000),
    ('try("print", function(e) return tostring(dae{ der(x) ~ e }) end, smooth)', 20000),
    ('try("factor", function(e) return tostring(factor(e)) end)', 20000),
    ('try("system", function(e) return tostring(tf(e, x)) end, { smooth[1] })', 50000),
    ('try("event", function(e) return dae{ der(x) ~ 1 }:integrate{ start = { x = 0 }, to = 1, events = { { when = e } } } end, { smooth[2] })', 50000),
)


def run(code, stack=None, limit=100):
    command = [PROGRAM, "-e", code]
    if stack:
        command = ["bash", "-c", f'ulimit -s {stack}; exec "$@"', "run", *command]
    return subprocess.run(command, capture_output=True, text=True, timeout=limit)


failed = 0


def expect(good, what):
    global failed
    if not good:
        print(what)
        failed += 1


for code, depth in WORK:
    done = run(NESTED % (1000 if SANITIZED else depth) + code + ' print "whole"')
    expect(done.stdout == "whole\n" and done.returncode == 0, f"{code}: {done.returncode} {done.stdout[-300:]}{done.stderr[-600:]}")

# Small stacks: the same at a smaller depth, and calls of callbacks of calls. The last line shows that the session goes on.
if not SANITIZED:
    for stack in (512, 256):
        for code, depth in WORK:
            done = run(NESTED % (depth // 5) + code + ' print "whole"', stack)
            expect(done.stdout == "whole\n" and done.returncode == 0, f"ulimit -s {stack}: {code}: {done.returncode} {done.stderr[-600:]}")
        done = run('x = var "x" local function again() return dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1, '
                   'events = { { when = x - 1/2, call = again } } } end local good, why = pcall(again) '
                   'print(good, why) print(fn(x, x^2)(3))', stack)
        expect(done.returncode == 0 and done.stdout.startswith("false") and done.stdout.endswith("9.0\n") and
               (REMEDY in done.stdout or "stack overflow" in done.stdout), f"ulimit -s {stack}: {done}")
    # A stack too small for what does not ask: the program says why it ends.
    done = run('local function f() return pcall(f) end f() print(f())', 64)
    expect((done.returncode, "the stack is used up" in done.stderr) in ((0, False), (1, True)), done)
sys.exit(failed != 0)
