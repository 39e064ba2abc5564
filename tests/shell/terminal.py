# A terminal that a test can type into: one tmux server of its own, one window. Waiting is for text, never for time.
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

PROGRAM = os.path.abspath(os.environ.get("PENDULA", "build/release/pendula"))
if not os.access(PROGRAM, os.X_OK):
    sys.exit(f"no program at {PROGRAM}: ./dev build makes it, the variable PENDULA names another one")
PATIENCE = float(os.environ.get("PENDULA_PATIENCE", "30"))  # seconds; a slow machine may need all of them


class Failure(Exception):
    pass


class Terminal:
    """A shell-less window that runs `command` and stays open when it ends."""

    count = 0

    def __init__(self, home, command=None, columns=100, rows=40, **environment):
        Terminal.count += 1
        self.socket = f"pendula-{os.getpid()}-{Terminal.count}"
        words = {"HOME": home, "TERM": "screen-256color", "LC_ALL": "C.UTF-8", "PATH": os.environ["PATH"]}
        if "ASAN_OPTIONS" in os.environ:
            words["ASAN_OPTIONS"] = os.environ["ASAN_OPTIONS"]
        words.update(environment)
        line = " ".join(f"{k}={quoted(v)}" for k, v in words.items())
        run = command or quoted(PROGRAM)
        # The trap keeps the shell alive when Ctrl-C is meant for the program; programs do not inherit it.
        script = f"trap : INT; env -i {line} {run}; echo \"[ended with $?]\"; exec sleep 1000"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", str(columns), "-y", str(rows), "sh", "-c", script)

    def tmux(self, *words, text=None):
        command = ["tmux", "-L", self.socket, *words]
        result = subprocess.run(command, input=text, capture_output=True, encoding="utf-8", timeout=60)
        if result.returncode != 0:
            raise Failure(f"{' '.join(command)}: {result.stderr.strip()}")
        return result.stdout

    def type(self, text):
        self.tmux("send-keys", "-l", "--", text)

    def key(self, *names):
        self.tmux("send-keys", *names)

    def enter(self, text):
        """Types a line and waits until it stands on the screen: only then can Ctrl-C not throw it away."""
        self.type(text)
        self.wait(text[-40:])
        self.key("Enter")

    def paste(self, text):
        self.tmux("load-buffer", "-", text=text)
        self.tmux("paste-buffer", "-p", "-r")

    def screen(self, *options):
        text = self.tmux("capture-pane", "-p", "-J", *options)
        return "\n".join(line.rstrip() for line in text.rstrip().split("\n"))

    def wait(self, expected, pattern=False, options=()):
        """Waits until the screen contains the text (or matches the pattern, ^ and $ being line ends)."""
        form = re.compile(expected if pattern else re.escape(expected), re.MULTILINE)
        end = time.monotonic() + PATIENCE
        while True:
            screen = self.screen(*options)
            if form.search(screen):
                return screen
            if time.monotonic() > end:
                raise Failure(f"waited for {expected!r}; the screen is\n{screen}")
            time.sleep(0.02)

    def wait_prompt(self, after=""):
        """Waits for an empty prompt at the end of the screen, below `after`."""
        return self.wait(re.escape(after) + r"[^\0]*^>\Z", pattern=True)

    def close(self):
        subprocess.run(["tmux", "-L", self.socket, "kill-server"], capture_output=True, timeout=60)


def started(terminal, **options):
    """A session at its first prompt."""
    window = terminal(**options)
    window.wait_prompt("Pendula")
    return window


def quoted(word):
    return "'" + word.replace("'", "'\\''") + "'"


class Suite:
    """Runs test functions, each with a fresh home folder; prints failures and the count."""

    def __init__(self):
        self.passed = self.failed = 0

    def run(self, tests):
        for test in tests:
            home = tempfile.mkdtemp(prefix="pendula-test-")
            opened = []

            def terminal(command=None, **options):
                opened.append(Terminal(home, command, **options))
                return opened[-1]

            try:
                test(terminal, home)
                self.passed += 1
            except (Failure, OSError, subprocess.TimeoutExpired) as error:
                self.failed += 1
                print(f"FAILED {test.__name__}: {error}")
            finally:
                for window in opened:
                    window.close()
                shutil.rmtree(home, ignore_errors=True)
        print(f"{self.passed} passed, {self.failed} failed")
        return 1 if self.failed else 0


def check(actual, expected, what=""):
    if actual != expected:
        raise Failure(f"{what}\n  expected {expected!r}\n  got      {actual!r}")


def check_in(expected, text, what=""):
    if expected not in text:
        raise Failure(f"{what}\n  {expected!r} is not in\n{text}")
