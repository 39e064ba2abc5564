# What is shown fits the window: 40, 80 and 200 columns, and a window that changes in between. LANG=C: ASCII.
import re
import sys

from terminal import Suite, check, check_in

SETUP = [
    "th1, th2, x, y, z = vars 'th1 th2 x y z'",
    "p1 = vec(sin(th1), -cos(th1))",
    "p2 = p1 + vec(sin(th2), -cos(th2))",
    "T = (p1.dot.T*p1.dot + p2.dot.T*p2.dot)/2",
    "arm = lagrange{ q = {th1, th2}, T = T, V = 9.81*(p1[2] + p2[2]) }",
    "sol = arm:integrate{ start = { th1 = 2, th2 = 1, th1_dot = 0, th2_dot = 0 }, to = 1 }",
    "pend = problems.pendulum.system or problems.pendulum",
    "d = iddata{ y = linspace(0, 1, 50), u = linspace(1, 0, 50), Ts = 0.1 }",
]
SHOWN = [
    "arm", "arm:trace()", "arm:structure()", "arm:constraints()", "sol", "sol:stats()", "plot(sol)", "sol:final()",
    "rk.dop853", "rk.radau(3)", "rk.gauss(2):report()", "eye(60)", "jacobian({sin(th1)*th2, x*y}, {th1, th2, x, y})",
    "mat{{1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21,22,23,24,25,26,27,28,29,30}}", "d", "tf({1},{1,2,1})",
    "tf({1},{1,2,1}):step()", "bode(tf({1},{1,2,1}))", "help()", "help 'integrate'", "help 'stiffness'", "help(sol)",
    "help 'model:independent'", "arm.reduce",
    "arm:integrate{ tspan = 3 }", "arm.nonsense", "undefined_name", "arm:integrate{ start = { th1 = 0 }, to = 1 }",
    "who", "apropos 'index'", "methods()", "newton{ r = { x^2 - 2 }, x = { x }, start = { 1 } }",
    "{{ name = 'a long name of a thing', value = 1.25, text = 'some words' }, "
    "{ name = 'b', value = 2, text = 'more words' }}",
    "problems.pendulum", "explain(sol)", "sol:check()", "linspace(0, 1, 30)", "expand((x + y + z + 1)^5)",
]
UNBROKEN = re.compile(r"^\S+$")


def wrapped_lines(window, columns):
    """Lines that the terminal had to wrap: joined they are longer than the window. What is typed may be."""
    text = window.screen("-S", "-")
    lines = []
    for line in text.split("\n"):
        if len(line) <= columns or line.startswith(("> ", "… ", "... ")):
            continue
        if not UNBROKEN.match(line.strip()):  # one word, such as the path of a file, stays whole
            lines.append(line)
    return lines


def clear(window):
    window.key("C-l")
    window.wait(r"\A>\Z", pattern=True)
    window.tmux("clear-history")


def show_all(window, columns):
    window.wait_prompt("Pendula")
    for line in SETUP:
        window.enter(line)
    complaints = []
    for line in SHOWN:
        clear(window)
        window.type(line)
        window.wait(line[-10:])
        window.key("Enter")
        window.wait(r"\n>\Z", pattern=True)
        complaints += [f"{line}: {long!r}" for long in wrapped_lines(window, columns)]
    check(complaints, [], f"wrapped at {columns} columns")


def at(columns):
    def test(terminal, home):
        show_all(terminal(columns=columns, rows=2000), columns)  # so high that nothing is paged

    test.__name__ = f"test_{columns}_columns"
    return test


test_40_columns, test_80_columns, test_200_columns = at(40), at(80), at(200)


def test_a_window_that_changes(terminal, home):
    window = terminal(columns=120, rows=50)
    window.wait_prompt("Pendula")
    for columns in (120, 44, 90, 60):
        window.tmux("resize-window", "-x", str(columns), "-y", "50")
        while f"50 {columns}" not in window.screen():  # tmux tells the program a little later
            clear(window)
            window.enter("os.execute 'stty size'")
            window.wait(r"^50 \d+\n[^\0]*>\Z", pattern=True)
        clear(window)
        window.enter("help 'abs'")
        window.wait("2.000000")
        window.enter("error(('word '):rep(40))")
        window.wait_prompt("word word")
        check(wrapped_lines(window, columns), [], f"resized to {columns}")
        longest = max(len(line) for line in window.screen().split("\n"))
        check(longest > columns - 12, True, f"the width of {columns} columns is used, not {longest}")


def test_a_terminal_without_utf_8(terminal, home):
    window = terminal(columns=100, rows=2000, LC_ALL="C", LANG="C")
    window.wait_prompt("Pendula")
    for line in SETUP + SHOWN:
        window.enter(line)
    window.enter("for i = 1, 2 do")
    window.enter("print(i) end")
    window.enter("--end")
    screen = window.wait(r"^> --end\n+>\Z", pattern=True, options=("-S", "-"))
    odd = [line for line in screen.split("\n") if not line.isascii()]
    check(odd, [], "not ASCII")
    check_in("theta" if "theta" in screen else "th1''", screen)
    check([line for line in screen.split("\n") if "?" in line and not line.startswith(">")][:3], [], "unknown signs")


if __name__ == "__main__":
    names = sys.argv[1:]
    tests = [f for name, f in list(globals().items()) if name.startswith("test_")]
    tests = [t for t in tests if not names or any(n in t.__name__ for n in names)]
    sys.exit(Suite().run(tests))
