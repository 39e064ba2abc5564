# The interactive session, driven through tmux as a person would.
import os
import re
import subprocess
import sys

from terminal import PROGRAM, Suite, check, check_in, quoted, started


HAS_READLINE = b"readline" in subprocess.run([PROGRAM, "--version"], stdout=subprocess.PIPE).stdout


def edits_lines(test):
    """Marks a test that a program built without readline cannot pass."""
    test.needs_readline = True
    return test


def test_values_are_echoed(terminal, home):
    w = started(terminal)
    w.enter("6 * 7")
    w.wait("^42$", pattern=True)
    w.enter("x = 5")
    w.enter("x, x + 1")
    w.wait("^5 +6$", pattern=True)
    w.enter("nil")
    w.enter("= ans + 10")
    w.wait("^15$", pattern=True)
    w.enter("{1, {2}, k = 'a'}")
    w.wait('{1, {2}, k = "a"}')
    w.enter("y = 3; y^2")
    w.wait("^9.0$", pattern=True)


def test_a_run_that_ends_early_says_so(terminal, home):
    w = started(terminal)
    w.enter('x = var "x"')
    w.enter("s = dae{ x.dot ~ x^2 }:integrate{ start = { x = 1 }, to = 2 }")
    w.wait("warning: integrate: stopped at t = 1")
    w.enter("v = s:final(x)")
    w.wait("warning: final: the value at the last point")
    w.enter("s2 = dae{ x.dot ~ -x }:integrate{ start = { x = 1 }, to = 2 }; print 'quiet'")
    w.wait("^quiet$", pattern=True)


def test_local_survives_its_line(terminal, home):
    w = started(terminal)
    w.enter("local speed <const> = 12")
    w.enter("local function twice(v) return 2 * v end")
    w.enter("twice(speed)")
    w.wait("^24$", pattern=True)


@edits_lines
def test_entry_of_several_lines(terminal, home):
    w = started(terminal)
    w.enter("for i = 1, 3 do")
    w.wait("^…$", pattern=True)
    w.enter("print('turn ' .. i)")
    w.enter("end")
    w.wait("turn 3")
    w.enter("1 +")
    w.enter("99")
    w.wait("^100$", pattern=True)
    w.key("Up")
    w.wait("^> 1 \\+\n… 99\\Z", pattern=True)
    w.key("Up")
    w.wait("^> for i = 1, 3 do\n…   print\\('turn ' .. i\\)\n… end\\Z", pattern=True)
    w.key("Enter")
    w.wait("turn 3[^\\0]*turn 3$", pattern=True)


@edits_lines
def test_a_block_is_edited_as_a_whole(terminal, home):
    w = started(terminal)
    for line in ("function mean(list)", "local sum = 0", "for i, v in ipairs(list) do", "sum = sum + v", "end"):
        w.enter(line)
        w.wait("^…\\Z", pattern=True)  # only then the next letters are no paste, which has its own blanks
    w.type("return sum/(#list)")
    w.wait("^> function mean\\(list\\)\n…   local sum = 0\n…   for i, v in ipairs\\(list\\) do\n…     sum = sum \\+ v\n"
           "…   end\n…   return sum/\\(#list\\)\\Z", pattern=True)
    w.key("Up", "Up", "Up", "Up", "C-e")  # into an earlier line
    w.type(" + 100")
    w.wait("…   local sum = 0 + 100")
    w.key("Down", "C-a")
    w.type("  --[[ here ]]")
    w.wait("…   --[[ here ]]  for i, v")
    w.key("C-a", "C-k")  # kills its line only
    w.wait("^…\n…     sum = sum", pattern=True)
    w.key("C-y", "Down", "Down", "Down", "C-e", "Enter")
    w.wait("^…\\Z", pattern=True)
    w.type("end")
    w.key("Enter")
    w.enter("mean{ 1, 3 }")
    w.wait("^52.0$", pattern=True)
    w.key("Up", "Up", "Down", "C-e", "BSpace", "BSpace", "BSpace", "BSpace", "BSpace", "BSpace", "Enter")
    w.wait("local sum = 0\n")
    w.enter("mean{ 1, 5 }")
    w.wait("^3.0$", pattern=True)


@edits_lines
def test_what_is_typed_is_coloured_and_suggested(terminal, home):
    w = started(terminal)
    w.enter("wagon = dae and 12 -- remark")
    w.wait_prompt("remark")
    w.type("wag")
    w.wait("^> wagon = dae and 12 -- remark\\Z", pattern=True)  # from the history, faintly
    w.wait("\033[90mon = dae", options=("-e",))
    w.key("Right")
    w.wait("^> wagon = dae and 12 -- remark\\Z", pattern=True)
    for part in ("\033[34mdae", "\033[35mand", "\033[36m12", "\033[90m-- remark"):
        w.wait(re.escape(part).replace("\033\\[", "\033\\[[0-9;]*"), pattern=True, options=("-e",))
    w.key("C-u")
    w.type("(1 + { 2 ")
    w.type("})")
    w.wait("\033[7m", options=("-e",))  # the bracket and its partner
    w.key("Enter")
    w = started(terminal, NO_COLOR="1")
    w.type("wag")
    w.wait("^> wag\\Z", pattern=True)
    check("\033" in w.screen("-e"), False)


@edits_lines
def test_a_block_higher_than_the_window(terminal, home):
    w = started(terminal, columns=40, rows=10)
    w.paste("\n".join(f"v{i} = {i}" for i in range(30)))
    w.wait("v29 = 29")
    w.key(*["Up"] * 29)
    w.wait("^> v0 = 0$", pattern=True)
    w.key("C-e")
    w.type("00")
    w.tmux("resize-window", "-x", "60", "-y", "12")
    w.key(*["Down"] * 29)
    w.wait("v29 = 29")
    w.key("Enter")
    w.enter("v0 + v29")
    w.wait("^29$", pattern=True)
    w.type("'" + "0123456789" * 7 + "'")
    w.key("C-a", "C-f")
    w.type("x")
    w.key("Enter")
    w.wait("^x0123456789[0-9\n]*$", pattern=True)


def test_commands(terminal, home):
    os.makedirs(os.path.join(home, "models"))
    w = started(terminal)
    w.enter(f"cd {home}")
    w.enter("cd models")
    w.wait(home + "/models")
    w.enter("cd ..")
    w.enter("ls")
    w.wait("^models/$", pattern=True)
    w.enter("pwd")
    w.wait("^" + home + "$", pattern=True)
    w.enter("log 'session.lua'")
    w.enter("mass = 12")
    w.enter("who")
    w.wait("^mass +number +12$", pattern=True)
    w.enter("time 6*mass")
    w.wait("^[0-9.e-]+ s\n72$", pattern=True)
    w.enter("time for i = 1, 3 do mass = mass + i end")
    w.enter("mass, 'kg'")
    w.wait("^18 +kg$", pattern=True)
    w.enter("log off")
    w.enter("reset")
    w.enter("who")
    w.wait("no variables yet")
    w.enter("ls = 5")  # a variable goes before the command
    w.enter("ls")
    w.wait("^5$", pattern=True)
    w.enter("log(1)")
    w.wait("^0$", pattern=True)
    with open(os.path.join(home, "session.lua")) as file:
        check(file.read().split("\n")[1:], ["mass = 12", "print(6*mass)", "for i = 1, 3 do mass = mass + i end", "print(mass, 'kg')", ""])


def test_errors_leave_the_session_alive(terminal, home):
    w = started(terminal)
    w.enter("error('it broke')")
    w.wait("^it broke$", pattern=True)
    w.enter("no_such_thing")
    w.wait("undefined variable 'no_such_thing'")
    w.enter("x y")
    w.wait("end of line expected near 'y'")
    w.enter("x != 2")
    w.wait("not equal is written ~=")
    w.enter("table.unpack({}, 1, 999900)")
    w.wait_prompt("999900)")
    w.enter("'still ' .. 'here'")
    w.wait("^still here$", pattern=True)


@edits_lines
def test_completion(terminal, home):
    os.makedirs(os.path.join(home, "data"))
    open(os.path.join(home, "data", "hairdryer.csv"), "w").close()
    w = started(terminal, command=f"sh -c {quoted('cd; exec ' + quoted(PROGRAM))}")
    w.enter("wagon = {mass = 1, length = 2, roll = function() return 'rolling' end}")
    w.type("wag")
    w.key("Tab")
    w.type(".")
    w.key("Tab", "Tab")
    w.wait("^length +mass +roll$", pattern=True)
    w.type("ma")
    w.key("Tab", "Enter")
    w.wait("^1$", pattern=True)
    w.type("wagon:")
    w.key("Tab")
    w.type("()")
    w.key("Enter")
    w.wait("^rolling$", pattern=True)
    w.type("#'da")
    w.key("Tab")
    w.type("hair")
    w.key("Tab", "Enter")
    w.wait("^18$", pattern=True)
    w.type("whi")
    w.key("Tab")
    w.wait("^> while$", pattern=True)


def test_ctrl_c_at_the_prompt(terminal, home):
    w = started(terminal)
    w.type("abandoned = 1")
    w.wait("> abandoned = 1")
    w.key("C-c")
    w.wait_prompt("abandoned = 1^C")
    w.enter("function unfinished()")
    w.wait("^…$", pattern=True)
    w.key("C-c")
    w.wait_prompt("…   ^C")
    w.enter("rawget(_G, 'abandoned') or 'not there'")
    w.wait("^not there$", pattern=True)
    # Not a letter may be lost after it.
    w.enter("'first' .. 'line'")
    w.wait("^firstline$", pattern=True)


def test_ctrl_c_in_a_lua_loop(terminal, home):
    w = started(terminal)
    for turn in (1, 2, 3):
        w.enter(f"kept = {turn}; print('busy', kept); while true do pcall(error) end")
        w.wait(f"^busy +{turn}$", pattern=True)
        w.key("C-c")
        w.wait_prompt(f"busy {turn}")
        check_in("interrupted", w.screen())
    w.enter("kept * 100")
    w.wait("^300$", pattern=True)


def test_ctrl_c_in_a_long_integration(terminal, home):
    w = started(terminal)
    w.enter("x = var 'x'; oscillator = dae { der(x, 2) ~ -x }")
    for times, told in (("{1e8}", "^interrupted$"), ("{0, 1, 1e8}", "^interrupted at t = ")):
        w.key("C-l")
        w.enter("print 'busy'; sol = oscillator:first_order():integrate "
                f"{{ start = {{x = 1, [x.dot] = 0}}, to = 1e8, times = {times}, dt = 1e-3, method = rk.rk4 }}")
        w.wait("^busy$", pattern=True)
        w.wait(r"integrate: t = [0-9.e+]+ of 1e\+08 \(0 %\), [0-9]+ steps", pattern=True)  # t = 1 is long past
        w.key("C-c")
        w.wait(told, pattern=True)
        w.wait_prompt("interrupted")
    w.enter("sol(x)")  # what was computed before Ctrl-C is there
    w.wait("0.5403")
    w.enter("'alive'")
    w.wait("^alive$", pattern=True)


def test_ctrl_c_in_a_sweep(terminal, home):
    w = started(terminal)
    w.enter('x, k = var "x", param "k"; model = dae{ der(x) ~ -k*x }')
    w.enter("print 'busy'; s = sweep(model, { start = { x = 1 }, to = 1000, method = rk.gauss(2), dt = 1e-3, "
            "times = { 1000 }, params = { k = linspace(1, 2, 1000) } })")
    w.wait("^busy$", pattern=True)
    w.wait("sweep: [0-9]+ of 1000 runs", pattern=True)
    w.key("C-c")
    w.wait("interrupted; the runs that are done are the result")
    w.wait_prompt()
    w.enter("print(#s, #s.failures > 0, s.failures[#s.failures].why)")
    w.wait("^1000 +true +not run: interrupted$", pattern=True)


@edits_lines
def test_ctrl_d(terminal, home):
    w = started(terminal)
    w.type("abc")
    w.wait("> abc")
    w.key("C-a", "C-d")  # deletes a letter, does not leave
    w.wait("> bc")
    w.key("C-c")
    w.wait_prompt("bc^C")
    w.enter("f(")
    w.wait("^…$", pattern=True)
    w.key("C-d")  # gives up the entry
    w.wait_prompt("…")
    w.key("C-d")
    w.wait("[ended with 0]")


def test_exit_and_quit(terminal, home):
    for word in ("exit", "quit", "quit()"):
        w = started(terminal)
        w.enter(word)
        w.wait("[ended with 0]")


@edits_lines
def test_history_across_sessions(terminal, home):
    w = started(terminal)
    w.enter("function area(r)")
    w.wait("^…\\Z", pattern=True)
    w.enter("return 'r\\\\' .. r  -- a backslash, \"quotes\"")
    w.wait("^…\\Z", pattern=True)
    w.enter("end")
    w.enter("area(2)")
    w.wait("^r\\\\2$", pattern=True)
    w.enter("area(2)")
    w.wait_prompt("r\\2\n> area(2)\nr\\2\n")
    w.key("C-d")
    w.wait("[ended with 0]")
    path = os.path.join(home, ".local/state/pendula/history")
    check(open(path).read().count("area(2)"), 1, "the same entry twice in a row is kept once")
    check(os.stat(path).st_mode & 0o777, 0o600)
    w = started(terminal)
    w.key("Up")
    w.wait("> area(2)")
    w.key("Up")
    w.wait("^> function area\\(r\\)\n…   return 'r\\\\\\\\' .. r  -- a backslash, \"quotes\"\n… end\\Z", pattern=True)
    w.key("Enter")
    w.enter("area(7)")
    w.wait("^r\\\\7$", pattern=True)


@edits_lines
def test_history_place(terminal, home):
    state = os.path.join(home, "state")
    w = started(terminal, XDG_STATE_HOME=state)
    w.enter("1")
    w.wait("^1$", pattern=True)
    check(open(os.path.join(state, "pendula/history")).read(), "1\n")


@edits_lines
def test_paste(terminal, home):
    w = started(terminal)
    w.paste("local a = 1\nfunction f(n)\n\treturn n + a\nend\nf(10)\nb = f(20)\nprint('b is ' .. b)\n")
    w.wait("print('b is ' .. b)")
    w.key("Enter")
    w.wait("^11$", pattern=True)
    w.wait("^b is 21$", pattern=True)
    w.key("Up")
    w.wait("^> local a = 1\n… function f[^\\0]*print\\('b is ' .. b\\)\\Z", pattern=True)
    w.key("C-c")
    w.paste("> c = 5\n> c * 3\n15\n> for i = 7, 8 do\n… print('i', i)\n… end\n")
    w.wait("… end")
    w.key("Enter")
    w.wait("^15\ni +7\ni +8\n", pattern=True)


@edits_lines
def test_large_paste(terminal, home):
    w = started(terminal)
    lines = [f"v{i} = {i}" for i in range(500)]
    w.paste("\n".join(lines) + "\nprint(v0 + v499, 'all')")
    w.wait("'all'\\)\\Z", pattern=True)
    w.key("Enter")
    w.wait("^499 +all$", pattern=True)


def test_question_mark(terminal, home):
    w = started(terminal)
    w.enter("apropos?")
    w.wait_prompt("apropos?")
    first = w.screen().split("apropos?", 1)[1]
    w.key("C-l")
    w.enter('help "apropos"')
    w.wait_prompt()
    check(w.screen().split('help "apropos"', 1)[1].strip(), first.strip())


def test_colour_only_for_people_who_want_it(terminal, home):
    w = started(terminal)
    w.enter("error 'red'")
    w.wait("\033[31mred", options=("-e",))
    for options in ({"NO_COLOR": "1"}, {"command": quoted(PROGRAM) + " --no-color"}, {"TERM": "dumb"}):
        w = started(terminal, **options)
        w.enter("error 'plain'")
        w.wait("^plain$", pattern=True)
        check("\033" in w.screen("-e"), False, f"escape sequences with {options}")


@edits_lines
def test_window_size_changes(terminal, home):
    w = started(terminal)
    w.tmux("resize-window", "-x", "60", "-y", "20")
    w.type("'" + "a" * 70 + "' .. 'end'")
    w.wait("'end'")
    w.tmux("resize-window", "-x", "90", "-y", "20")
    w.key("C-a", "C-k")
    w.wait_prompt()
    w.enter("1 + 2")
    w.wait("^3$", pattern=True)


def test_what_is_there_and_where_one_is(terminal, home):
    os.makedirs(os.path.join(home, "models"))
    w = started(terminal)
    w.enter("mass = 12")
    w.enter("who()")
    w.wait("^mass +number +12$", pattern=True)
    w.enter(f"cd '{home}'")
    w.enter("ls()")
    w.wait("models/")
    w.enter("cd 'nowhere'")
    w.wait("cd: 'nowhere': No such file or directory")
    w.enter("record 'session.lua'")
    w.enter("6*mass")
    w.wait("^72$", pattern=True)
    w.enter("no_such_thing")
    w.enter("half = mass/2")
    w.enter("record(false)")
    w.wait_prompt("record(false)")
    with open(os.path.join(home, "session.lua")) as file:
        check(file.read().split("\n")[1:], ["print(6*mass)", "half = mass/2", ""])


def test_text_fits_the_window(terminal, home):
    for columns in (40, 80, 200):
        w = started(terminal, columns=columns, rows=60)
        w.enter("q = var('q', 3)")
        w.enter("sum{ q[1]*sin(q[2]), q[2]*cos(q[3]), q[3]*q[1]^2, exp(q[1])*q[2], sin(q[1])*cos(q[2])^3 }")
        w.wait("q₃")
        w.enter("error(('word '):rep(60))")
        w.wait("word word")
        w.key("C-l")
        w.enter('help "fixed steps"')
        w.wait("See also")
        for line in w.tmux("capture-pane", "-p").split("\n"):  # not joined: what was too long stands on two lines
            check(len(line.rstrip()) <= columns, True, line)
        check_in("study a method", " ".join(w.screen().split()))


def test_long_text_comes_a_screen_at_a_time(terminal, home):
    w = started(terminal, columns=80, rows=20)
    w.enter('help "integrate"')
    w.wait("-- more")
    check_in("sys:integrate{", w.screen())
    w.key("Space")
    w.wait("rtol = 1e-6")
    w.key("q")
    w.wait("^>$", pattern=True)
    w.enter("'still ' .. 'here'")
    w.wait("^still here$", pattern=True)
    w.enter("eye(40)")
    w.wait("-- more")
    w.key("C-c")
    w.enter("1 + 1")
    w.wait("^2$", pattern=True)
    w.enter("print(eye(3))")  # short text is not paged
    w.wait("⎣0  0  1⎦")


@edits_lines
def test_options_are_completed(terminal, home):
    w = started(terminal)
    w.enter('x = var "x"; m = dae { der(x) ~ -x }')
    w.type("m:integrate { ")
    w.key("Tab", "Tab")
    w.wait("max_steps")
    w.type("start = { ")
    w.key("Tab")
    w.type(' = 1 }, to = 1, method = "dop853" }')
    w.wait("start = { x = 1 }")
    w.key("Enter")
    w.wait("solution by dop853")


@edits_lines
def test_suspend_and_resume(terminal, home):
    w = terminal(command="bash --norc --noprofile", PS1="shell: ")
    w.wait("shell:")
    w.enter(quoted(PROGRAM))
    w.wait_prompt("Pendula")
    w.type("6 * ")
    w.wait("> 6 *")
    w.key("C-z")
    w.wait("Stopped")
    w.enter("fg")
    w.wait("^> 6 \\*\\Z", pattern=True)
    w.type("7")
    w.key("Enter")
    w.wait("^42$", pattern=True)


def test_script_then_session(terminal, home):
    path = os.path.join(home, "model.lua")
    with open(path, "w") as file:
        file.write("mass = 4\nlocal hidden = 1\nprint('loaded', ...)\n")
    w = terminal(command=f"{quoted(PROGRAM)} -i {quoted(path)} red blue")
    w.wait_prompt("loaded red blue")
    w.enter("mass * 2, arg[2]")
    w.wait("^8 +blue$", pattern=True)
    with open(path, "a") as file:
        file.write("error('half way')\n")
    w = terminal(command=f"{quoted(PROGRAM)} -i {quoted(path)}")
    w.wait_prompt("model.lua:4: half way")
    w.enter("mass")
    w.wait("^4$", pattern=True)
    w.key("C-d")
    w.wait("[ended with 1]")


def test_ctrl_c_in_a_script(terminal, home):
    w = terminal(command=f"{quoted(PROGRAM)} -e {quoted('print(1) while true do end')}")
    w.wait("^1$", pattern=True)
    w.key("C-c")
    w.wait("interrupted")
    w.wait("[ended with 130]")


if __name__ == "__main__":
    names = sys.argv[1:]
    tests = [value for name, value in list(globals().items()) if name.startswith("test_")]
    tests = [t for t in tests if HAS_READLINE or not hasattr(t, "needs_readline")]
    sys.exit(Suite().run([t for t in tests if not names or any(n in t.__name__ for n in names)]))
