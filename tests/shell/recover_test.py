# Sessions that were cut off: by the terminal, by a signal; their entries run again.
import os
import sys
import time

from terminal import Suite, check, started


def test_a_session_that_was_cut_off_comes_back(terminal, home):
    w = started(terminal)
    w.enter("mass = 12")
    w.enter("no_such_thing")
    w.enter("mass/2")
    w.wait("^6.0$", pattern=True)
    w.enter("1 + 1")
    w.wait("^2$", pattern=True)  # what came before is in the journal now
    w.close()  # the terminal goes away
    folder = os.path.join(home, ".local/state/pendula/sessions")
    check(len(os.listdir(folder)), 1)
    time.sleep(0.5)  # until the program has gone, too
    w = terminal()
    w.wait("ended unexpectedly")
    w.enter("recover()")
    w.wait("^6.0$", pattern=True)
    w.enter("mass, 'kg'")
    w.wait("^12 +kg$", pattern=True)
    w.enter("exit")
    w.wait("[ended with 0]")
    check(os.listdir(folder), [])


def test_an_entry_that_fails_again_costs_only_itself(terminal, home):
    with open(os.path.join(home, "editor"), "w") as file:
        file.write('#!/bin/sh\necho "speed = 77" >> "$1"\n')
    os.chmod(os.path.join(home, "editor"), 0o755)
    w = started(terminal, EDITOR=os.path.join(home, "editor"))
    w.enter(f"cd {home}")
    w.enter("edit model.lua")
    w.wait_prompt("model.lua")
    w.enter("local lost = 'a local'")
    w.enter("checked = assert(speed == 77, 'another speed')")
    w.enter("for i = 1, 2 do")
    w.enter("  kept = speed + i end")
    w.enter("kept + 0, 'kept'")
    w.wait("^79 +kept$", pattern=True)
    w.enter("os.execute 'kill -KILL $PPID'")
    w.wait("[ended with 137]")
    for told in ("another speed[^\\0]*", ""):  # the second time from the journal of the session that recovered
        with open(os.path.join(home, "model.lua"), "w") as file:
            file.write("speed = 7\n")
        w = terminal()
        w.wait("ended unexpectedly")
        w.enter("recover()")
        w.wait(told + "^9 +kept$", pattern=True)
        w.wait_prompt("kept")
        w.enter("no_such_thing")
        w.enter("speed, kept, lost")
        w.wait("^7 +9 +a local$", pattern=True)
        w.enter("os.execute 'kill -KILL $PPID'")
        w.wait("[ended with 137]")


def test_a_killed_session_comes_back(terminal, home):
    for signal, status in (("HUP", 129), ("KILL", 137)):
        w = started(terminal)
        w.enter(f"mass = {status}")
        w.enter("1 + 1")
        w.wait("^2$", pattern=True)
        w.enter(f"os.execute 'kill -{signal} $PPID'")
        w.wait(f"[ended with {status}]")
        w = terminal()
        w.wait("ended unexpectedly")
        w.enter("recover()")
        w.wait("^2$", pattern=True)
        w.enter("2*mass")
        w.wait(f"^{2*status}$", pattern=True)
        w.enter("exit")
        w.wait("[ended with 0]")


if __name__ == "__main__":
    names = sys.argv[1:]
    tests = [f for name, f in list(globals().items()) if name.startswith("test_")]
    sys.exit(Suite().run([t for t in tests if not names or any(n in t.__name__ for n in names)]))
