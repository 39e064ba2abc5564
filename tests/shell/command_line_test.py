# The command line: what runs, what is printed where, which exit status.
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

from terminal import PATIENCE, PROGRAM, Suite, check, check_in


def run(*words, stdin="", expect=0, **options):
    """Runs the program; the result has stdout and stderr as text."""
    result = subprocess.run([PROGRAM, *words], input=stdin, capture_output=True, encoding="utf-8",
                            timeout=4 * PATIENCE, **options)
    check(result.returncode, expect, f"pendula {' '.join(words)}: status; {result.stdout}{result.stderr}")
    return result


def write(home, name, text):
    path = os.path.join(home, name)
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(text)
    return path


def test_script_and_arguments(terminal, home):
    path = write(home, "exam.lua", "print(arg[0], arg[1], #arg, ...)\n")
    check(run(path, "one", "-e", "--help").stdout, f"{path} one 3 one -e --help\n")
    path = write(home, "test", "print 'a script named test'")
    check(run("./test", cwd=home).stdout, "a script named test\n")
    check(run("--", "test", cwd=home).stdout, "a script named test\n")
    check(run("-e", "print(arg[0] == arg[-2], arg[1])").stdout, "false nil\n")


def test_code(terminal, home):
    check(run("-e", "x = 1", "-e", "print(x)", "-eprint(x + 1)").stdout, "1\n2\n")
    path = write(home, "a.lua", "print(x, ...)")
    check(run("-e", "x = 5", path, "b").stdout, "5 b\n")
    check(run("-e", "print 'π'").stdout, "π\n")


def test_require_looks_beside_the_script_and_in_the_folder_of_the_user(terminal, home):
    os.makedirs(os.path.join(home, "course"))
    os.makedirs(os.path.join(home, ".local/share/pendula"))
    write(home, "course/motor.lua", "return 'motor'")
    write(home, ".local/share/pendula/own.lua", "return 'own'")
    write(home, "course/exam.lua", "print((require 'motor'), (require 'own'))\n")
    check(run(os.path.join(home, "course/exam.lua"), cwd="/", env={**os.environ, "HOME": home}).stdout, "motor own\n")


def test_errors_name_the_callers(terminal, home):
    path = write(home, "calls.lua", "local function f() return nil + 1 end\nlocal function g()\n  local v = f()\n"
                                    "  return v\nend\ng()\n")
    error = run(path, expect=1).stderr
    check(error.startswith(path + ":1: "), True, error)
    check_in(f"called from {path}:3", error)
    check_in(f"called from {path}:6", error)
    path = write(home, "callback.lua", """local function force(t) return t .. nil end
local function law(t)
  local u = force(t)
  return 2*u
end
x, u = var "x", input "u"
local function run()
  local s = dae{ der(x) ~ u - x }:integrate{ start = { x = 1 }, to = 1, inputs = { u = law } }
  return s
end
for i = 1, 2 do print(i == 1 and pcall(run) or run()) end
""")
    error = run(path, expect=1).stderr
    check(error.splitlines(), [f"{path}:1: attempt to concatenate a nil value"]
          + [f"  called from {path}:{line}" for line in (3, 8, 11)], "through a callback")
    path = write(home, "order.lua", "list = { 3, 1, 2, 5, 4 }\ntable.sort(list, function() return true end)\n")
    check_in(f"{path}:2: invalid order function", run(path, expect=1).stderr)
    path = write(home, "brackets.lua", "x = " + "("*100000 + "1" + ")"*100000)
    check_in(f"{path}: brackets, functions or blocks are nested more than", run(path, expect=1).stderr)
    path = write(home, "flat.lua", "print(nil + 1)\n")
    check("called from" in run(path, expect=1).stderr, False)


def test_tables_are_printed(terminal, home):
    check(run("-e", "print({1, {2, x = 3}}, {}, 0/0)").stdout, "{1, {2, x = 3}} {} nan\n")


def test_a_syntax_error_in_a_long_script_is_told_at_once(terminal, home):
    path = write(home, "long.lua", "x = 1 + 2 * (3 - 4)\n" * 150000 + "y != 3\n")
    begun = time.monotonic()
    check_in("not equal is written ~=", run(path, expect=1).stderr)
    check(time.monotonic() - begun < 20, True, "seconds")


def test_standard_input(terminal, home):
    check(run(stdin="local x = 1\nprint(x)").stdout, "1\n")
    check(run("-", "a", "b", stdin="print(...)").stdout, "a b\n")
    check(run("-", stdin="#!/usr/bin/env pendula\nprint 'shebang'").stdout, "shebang\n")
    check(run(stdin="").stdout, "")


def test_first_error_ends_it_however_it_was_started(terminal, home):
    broken = "print 'before'\nprint(nil + 1)\nprint 'after'\n"
    path = write(home, "broken.lua", broken)
    for words, stdin, place in (([path], "", f"{path}:2:"), (["-"], broken, "stdin:2:"), ([], broken, "stdin:2:"),
                                (["-e", broken], "", "-e:2:"), (["-e", broken, "-e", "print 'later'"], "", "-e:2:"),
                                (["-i", path], "", f"{path}:2:")):
        result = run(*words, stdin=stdin, expect=1)
        check(result.stdout.startswith("before\n"), True, f"{words}: {result.stdout}")
        check("after" in result.stdout or "later" in result.stdout, False, f"{words}: {result.stdout}")
        check_in(place, result.stderr, str(words))
        check("\033" in result.stderr, False, "colour without a terminal")


def test_preamble_and_line_numbers(terminal, home):
    check(run(write(home, "a.lua", "#!/usr/bin/env pendula\nprint 'ran'")).stdout, "ran\n")
    check(run(write(home, "b.lua", "\ufeffprint 'mark'")).stdout, "mark\n")
    check(run(write(home, "c.lua", "print 'dos'\r\n")).stdout, "dos\n")
    check_in("d.lua:2:", run(write(home, "d.lua", "#!shebang\nerror 'x'"), expect=1).stderr)
    check_in("e.lua:3: ", run(write(home, "e.lua", "x = 1\n\nif x != 1 then end"), expect=1).stderr)
    check_in("not equal is written ~=", run(os.path.join(home, "e.lua"), expect=1).stderr)


def test_files_that_cannot_be_run(terminal, home):
    write(home, "exam.lua", "")
    result = run("exma.lua", expect=1, cwd=home)
    check_in("cannot read 'exma.lua': No such file or directory. Did you mean 'exam.lua'?", result.stderr)
    check_in("Is a directory", run(home, expect=1).stderr)
    path = write(home, "code.luac", "\x1bLua nonsense")
    check_in("binary", run(path, expect=1).stderr)


def test_usage(terminal, home):
    root = os.environ.get("PENDULA_ROOT") or os.path.join(os.path.dirname(__file__), "../..")
    with open(os.path.join(root, "CHANGELOG.md"), encoding="utf-8") as file:
        newest = next(line[3:].strip() for line in file if re.match(r"## \d", line))
    check(run("--version").stdout.split()[:2], ["pendula", newest])
    check(run("-v").stdout, run("--version").stdout)
    check_in("usage: pendula", run("--help").stdout)
    check_in("unknown option '--verison'. Did you mean '--version'?", run("--verison", expect=2).stderr)
    check_in("unknown option '-x'", run("-x", "a.lua", expect=2).stderr)
    check_in("option -e needs", run("-e", expect=2).stderr)
    check_in("'pendula test' needs", run("test", expect=2).stderr)
    check_in("empty", run("", expect=2).stderr)


def test_scripted_tests(terminal, home):
    good = write(home, "good.lua", "test('sum', function() expect(1 + 1):equals(2) end)")
    check_in("1 passed, 0 failed", run("test", good).stdout)
    write(home, "bad.lua", "test('sum', function() expect(1 + 1):equals(3) end)")
    result = run("test", home, expect=1)
    check_in("1 passed, 1 failed", result.stdout)
    check_in("bad.lua:1:", result.stdout + result.stderr)


def test_session_without_a_terminal(terminal, home):
    result = run("-i", stdin="1 + 1\nfor i = 1, 2 do\nprint('i', i)\nend\nerror 'no'\n'alive'")
    for text in ("> 2\n", "i 1\ni 2\n", "> alive\n"):
        check_in(text, result.stdout)
    check_in("no\n", result.stderr)
    check("Pendula" in result.stdout, False, "the banner is for people")


def test_exit_from_lua(terminal, home):
    run("-e", "os.exit(7)", expect=7)
    run("-e", "os.exit(false)", expect=1)
    check(run("-e", "io.write 'flushed' os.exit(true)").stdout, "flushed")


def interrupted(process):
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    check(process.returncode, 130, err)
    check(err.splitlines()[-1:], ["interrupted"], err)
    return out


def test_ctrl_c_ends_a_script(terminal, home):
    loop = "print 'busy' io.flush() while true do pcall(function() while true do end end) end"
    path = write(home, "loop.lua", loop)
    for words in ([path], ["-e", loop]):
        process = subprocess.Popen([PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        check(process.stdout.readline(), "busy\n")
        interrupted(process)
    process = subprocess.Popen([PROGRAM, "-e", "print 'busy' io.flush() io.read() print 'no'"], text=True,
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    check(process.stdout.readline(), "busy\n")
    check("no" in interrupted(process), False)


def test_no_progress_line_in_a_pipe(terminal, home):
    result = run("-e", "x = var 'x'  print(dae { der(x, 2) ~ -x }:first_order():integrate { start = { x = 1, [x.dot] = 0 }, "
                 "to = 3e4, times = { 3e4 }, dt = 0.01, method = rk.gauss(3) }.status)")       # about a second
    check(result.stdout, "finished\n")
    check(result.stderr, "")


def test_output_that_goes_nowhere(terminal, home):
    process = subprocess.Popen([PROGRAM, "-e", "for i = 1, 1e9 do print(i) end"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    check(process.stdout.readline(), "1\n")
    process.stdout.close()
    check(process.stderr.read(), "", "a broken pipe is quiet")
    check(process.wait(timeout=PATIENCE) != 0, True)
    with open("/dev/full", "w") as full:
        result = subprocess.run([PROGRAM, "-e", "print(1)"], stdout=full, stderr=subprocess.PIPE, text=True)
    check(result.returncode, 1)
    check_in("cannot write standard output", result.stderr)


def test_error_in_a_long_script(terminal, home):
    script = os.path.join(home, "long.lua")
    with open(script, "w") as file:
        file.write("x = 1\n" * 500000 + "y = = 3\n")  # 3 MB; hints of what was meant look at the line alone
    begin = time.monotonic()
    result = run(script, expect=1)
    check_in("long.lua:500001: ", result.stderr)
    check(time.monotonic() - begin < PATIENCE / 3, True, "the error comes within seconds")
    with open(script, "wb") as file:
        file.write(b"\x1bLua")
    result = run("test", script, expect=1)
    check_in("long.lua: this is binary Lua code", result.stdout + result.stderr)


def processor_seconds(command, environment, until=b""):
    """Of a program on a terminal, from fork until it has written this, or to its end."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.execve(command[0], command, environment)
    seen = b""
    try:
        while (not until or until not in seen) and select.select([terminal], [], [], PATIENCE)[0]:
            seen += os.read(terminal, 4096)
    except OSError:  # it has ended
        pass
    if until:
        os.kill(pid, signal.SIGKILL)
    used = os.wait4(pid, 0)[2]
    os.close(terminal)
    check(until in seen, True, f"{command[0]} does not write {until!r}")
    return used.ru_utime + used.ru_stime


def test_prompt_as_soon_as_python(terminal, home):
    with open(PROGRAM, "rb") as file:
        if b"__asan_init" in file.read():
            return
    # "At once" is 10 ms on the machines we know, where an empty script takes Python 10.6 ms and the prompt 9 ms. The
    # ratio holds on slower ones, too. Processor time, since starting waits for nothing; the best of some starts.
    environment = {"HOME": home, "TERM": "xterm", "LC_ALL": "C.UTF-8"}
    pairs = [(processor_seconds([PROGRAM], environment, until=b"> "),
              processor_seconds(["/usr/bin/python3", "-I", "-c", ""], environment)) for _ in range(20)]
    ours, python = map(min, zip(*pairs))
    told = f"prompt after {1000 * ours:.1f} ms of processor time, an empty script of Python {1000 * python:.1f} ms"
    print(told)
    check(ours < 1.25 * python, True, told)


if __name__ == "__main__":
    names = sys.argv[1:]
    tests = [value for name, value in list(globals().items()) if name.startswith("test_")]
    sys.exit(Suite().run([t for t in tests if not names or any(n in t.__name__ for n in names)]))
