"""pendula grade: the example course, and submissions that work against the grader."""
import json
import os
import subprocess
import tempfile

PROGRAM, ROOT = os.environ["PENDULA"], os.environ["PENDULA_ROOT"]
TASKS = os.path.join(ROOT, "scripts/grading/tasks.lua")
COURSE = os.path.join(ROOT, "scripts/grading/submissions")
if "PENDULA_SANITIZED" in os.environ:  # leaks cannot be sought behind the walls
    os.environ["ASAN_OPTIONS"] += ":detect_leaks=0"


def grade(*arguments, status=0):
    done = subprocess.run([PROGRAM, "grade", *arguments], capture_output=True, text=True, timeout=100)
    assert done.returncode == status, (arguments, done)
    return done.stdout if status == 0 else done.stderr


def graded(*arguments):
    report = json.loads(grade(*arguments, "--json"))
    return {s["submission"]: s for s in report["submissions"]}, report


text = grade(TASKS, COURSE, "--time", "1s", "--json")
assert text == grade(TASKS, COURSE, "--time", "1s", "--json"), "two runs, two reports"
report = json.loads(text)
by_name = {s["submission"]: s for s in report["submissions"]}
assert list(by_name) == sorted(by_name) and report["of"] == 15


def verdicts(name):
    return {a["task"]: a["verdict"] for a in by_name[name]["answers"]}


def answer(name, task):
    return next(a for a in by_name[name]["answers"] if a["task"] == task)


assert by_name["ada.lua"]["points"] == 15, by_name["ada.lua"]
assert set(verdicts("ada.lua").values()) <= {"right", "equivalent"}
assert verdicts("ada.lua")["energy"] == "right" and answer("ada.lua", "energy")["line"] == 4
assert by_name["ben.lua"]["points"] == 15, by_name["ben.lua"]
for task in ("energy", "pendulum", "method"):
    assert verdicts("ben.lua")[task] == "equivalent", (task, by_name["ben.lua"])
cem = by_name["cem.lua"]
assert cem["outcome"] == "error" and "Did you mean" in cem["message"] and "cem.lua:10" in cem["message"], cem
assert answer("cem.lua", "energy")["points"] == 1 and "sign" in answer("cem.lua", "energy")["feedback"], cem
assert verdicts("cem.lua") == {"energy": "partly", "pendulum": "wrong", "index": "wrong", "period": "wrong",
                               "method": "wrong", "higher": "wrong", "poles": "wrong", "plant": "missing"}, cem
assert "order 1" in answer("cem.lua", "higher")["feedback"]
dora = by_name["dora.lua"]
assert dora["outcome"] == "time" and "os.execute" in dora["forbidden"], dora
emil = by_name["emil.lua"]
assert emil["points"] == 0 and emil["outcome"] == "finished", emil

work = tempfile.mkdtemp(prefix="pendula-grade-")


def write(name, source):
    path = os.path.join(work, name)
    with open(path, "w") as file:
        file.write(source)
    return path


# Expressions: the same functions, and almost the same ones.
tasks = write("tasks.lua", """
local x, y, k = var "x", var "y", param "k"
task { "a", answer = sin(x)^2*k + log(x*y) }
task { "b", answer = mat{ { 1, x }, { 0, "1/3" } } }
task { "c", answer = exp(-x^2), range = { x = { -2, 2 } } }
task { "d", answer = "Radau" }
task { "e", answer = x^2 ~ y }
task { "f", answer = tf({ 1 }, { 1, 2, 1 }) }
task { "h", answer = { 1, 2, { 3, x } } }
task { "g", answer = tf({ 1 }, { 1, 2, 1 }) }
task { "w", answer = dae { der(x) ~ -k*x + y, 0 ~ y - x^2 } }
""")
right = write("right.lua", """local x, y, k = param "x", var "y", var "k"
a = k*(1 - cos(2*x))/2 + log(y*x)
b = { { 1, x }, { 0, 1/3 } }
b = mat(b)
c = 1/exp(x*x)
d = " radau "
e = y ~ x^2
f = tf({ 2 }, { 2, 4, 2 })
g = tf({ 1 }, { 1, 2, 1 }):ss()
h = { 1, 2.0, { 3, 2*x/2 } }
x, y, k = var "x", var "y", param "k"
w = dae { 2*der(x) + 2*k*x ~ 2*y, x^2 ~ y } """)
almost = write("almost.lua", """local x, y, k = vars "x y k"
a = k*(1 - cos(2*x))/2 + log(y)*log(x)
b = mat{ { 1, x }, { 0, 0.333 } }
c = exp(-x^2)*(1 + 1e-6)
d = "radau 2"
e = x^2 ~ y + 1
f = tf({ 1 }, { 1, 2, 1.001 })
g = tf({ 1 }, { 1, 2, 3 }):ss()
h = { 1, 2, { 3, x, x } }
w = dae { der(x) ~ -k*x + y, 0 ~ y - x^3 }""")
found, _ = graded(tasks, right, almost)
assert all(a["verdict"] in ("right", "equivalent") for a in found["right.lua"]["answers"]), found["right.lua"]
assert all(a["verdict"] == "wrong" for a in found["almost.lua"]["answers"]), found["almost.lua"]

# Values beyond every number are near no number; branches that are right only where one looks are wrong.
tasks_inf = write("tasks_inf.lua", """local x = var "x"
task { "n", answer = 3 }
task { "e", answer = x^2 + 1 }
task { "f", answer = abs(x) }
task { "g", answer = tf({ 1 }, { 1, 3, 2 }) }""")
infinite = write("infinite.lua", """local x = var "x"
n = 1/0
e = ifelse(lt(x, 100), x^2 + 1, 0)
f = ifelse(lt(x, 0), -x, 2*x - x*(1 + 1e-3))
g = tf({ 1, 5 }, { 1, 8, 17, 11 })""")
exact = write("exact.lua", """local x = var "x"
n = rational(10)^100000
e = ifelse(lt(abs(x), 1e-5), 0, x^2 + 1)
f = x*sign(x)
g = -2*math.huge""")
fine = write("fine.lua", """local x = var "x"
n = 3.0
e = ifelse(lt(x, 0), x^2 + 1, 1 + x*x)
f = ifelse(lt(x, 0), -x, x)
g = tf({ 1, 5 }, { 1, 8, 17, 10 })""")
found, _ = graded(tasks_inf, infinite, exact, fine)
assert all(a["verdict"] == "wrong" for a in found["infinite.lua"]["answers"]), found["infinite.lua"]
assert [a["verdict"] for a in found["exact.lua"]["answers"]] == ["wrong", "wrong", "equivalent", "wrong"], found["exact.lua"]
assert all(a["verdict"] in ("right", "equivalent") for a in found["fine.lua"]["answers"]), found["fine.lua"]

# Crashes, bombs, tricks: each costs one submission.
folder = os.path.join(work, "many")
os.mkdir(folder)
tricks = {
    "bomb": "a = 1 local t = {} while true do t[#t + 1] = ('x'):rep(1e6) end",
    "deep": "local t = {} t[1] = t a = t",
    "huge": "a = var 'x' for i = 1, 20 do a = a*a + i end",
    "report": "a = 1 for fd = 3, 9 do local f = io.open('/proc/self/fd/' .. fd, 'w') if f then f:write 'R' end end",
    "exit": "a = 5 os.exit(0)",
    "exit3": "a = 5 os.exit(3)",
    "code": "a = setmetatable({}, { __index = function() while true do end end, __len = function() return 1e9 end })",
    "bytecode": "\x1bLua",
    "empty": "",
    "protect": "getmetatable(_G).__newindex = nil a = 7",
    "good": "a = 7",
}
for name, source in tricks.items():
    write(os.path.join("many", name + ".lua"), source)
for k in range(12):
    write(os.path.join("many", f"same{k:02}.lua"), f"\n\na = {7 if k % 2 else 8}")
one = write("one.lua", 'task { "a", answer = 7 }')
found, _ = graded(one, folder, "--time", "1s", "--memory", "300M")
assert found["good.lua"]["points"] == 1
for name in tricks:
    if name not in ("good", "protect"):
        assert found[name + ".lua"]["points"] == 0, found[name + ".lua"]
for k in range(12):
    assert found[f"same{k:02}.lua"]["points"] == k % 2 and found[f"same{k:02}.lua"]["answers"][0]["line"] == 3
assert "os.exit with status 3" in found["exit3.lua"]["message"], found["exit3.lua"]
assert "bytecode" in found["bytecode.lua"]["message"] or "binary" in found["bytecode.lua"]["message"]

# What a submission says is no line of the report, and no command to a terminal.
forger = write("forger.lua", r"a = 8 error('\27[2J\r\nhonest.lua: 1 of 1\n  a               right      1 of 1')")
done = subprocess.run([PROGRAM, "grade", one, forger], capture_output=True, text=True, timeout=60)
lines = done.stdout.splitlines()
assert [line for line in lines if line.startswith("honest")] == [] and "\x1b" not in done.stdout, lines
assert not any(line.startswith("  a ") and " right " in line for line in lines), lines
turned = write("turned.lua", "error '\u202e\x9b2J'")
done = subprocess.run([PROGRAM, "grade", one, turned, "--json"], capture_output=True, text=True, timeout=60)
assert r"\u202e" in done.stdout and "\u202e" not in done.stdout, done.stdout

# Files that are no submission cost one: links (to the teacher's solution), devices, huge ones.
odd = os.path.join(work, "odd")
os.mkdir(odd)
write(os.path.join("odd", "good.lua"), "a = 7")
write("solution.lua", "a = 7")
os.symlink(os.path.join(work, "solution.lua"), os.path.join(odd, "link.lua"))
os.symlink("nowhere", os.path.join(odd, "dangling.lua"))
os.mkfifo(os.path.join(odd, "pipe.lua"))
with open(os.path.join(odd, "huge.lua"), "wb") as file:
    file.truncate(1 << 33)
found, _ = graded(one, odd)
assert {name: row["points"] for name, row in found.items()} == {
    "good.lua": 1, "link.lua": 0, "dangling.lua": 0, "pipe.lua": 0, "huge.lua": 0}, found
for name, words in (("link", "symbolic link"), ("dangling", "symbolic link"), ("pipe", "regular file"), ("huge", "at most")):
    assert words in found[name + ".lua"]["message"], found[name + ".lua"]

# Tasks that are none.
for source, words in (("", "no task"), ("task { 'a' }", "give an answer"), ("task { 'fit', answer = 1 }", "vocabulary"),
                      ("task { 'a', answer = 1 } task { 'a', answer = 2 }", "twice"), ("x = = 1", "unexpected"),
                      ("task { 'a', answer = 1, point = 2 }", "unknown option 'point'"),
                      ("task { 'a b', answer = 1 }", "name"), ("task { 'a', answer = 1, points = 'x' }", "expected a number")):
    message = grade(write("bad.lua", source), right, status=2)
    assert words in message, (source, message)
assert "cannot read" in grade(os.path.join(work, "none.lua"), right, status=2)
assert "needs tasks" in grade(one, status=2)
print(f"{len(by_name) + len(found) + 2} submissions graded")
