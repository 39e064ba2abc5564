# Systems that allow no executable memory (systemd's MemoryDenyWriteExecute, SELinux): everything runs on the tape.
import ctypes
import subprocess
import sys

from terminal import PATIENCE, PROGRAM, Suite, check, check_in

PR_SET_MDWE, REFUSE_EXEC_GAIN = 65, 1

SCRIPT = """
local x, y, a = var "x", var "y", param("a", 2)
local plain = dae{ der(x) ~ -a*x + sin(t) }
local stiff = dae{ der(x) ~ -1000*(x - cos(t)), der(y) ~ x - y }
local small = dae{ der(x) ~ y, 0 ~ x + y + 0.1*y^3 }
local function last(model, options)
  options.start, options.to = options.start or { x = 1 }, options.to or 1
  return ("%.6f"):format(model:integrate(options):final(x))
end
print(last(plain, {}), last(plain, { method = "dopri5" }), last(plain, { method = rk.rk4, dt = 0.01 }))
for _, method in ipairs { "radau", "rodas", "bdf", "gauss" } do
  print(method, last(stiff, { method = method, start = { x = 1, y = 0 }, rtol = 1e-8 }), last(small, { method = method, rtol = 1e-8 }))
end
local many = sweep(plain, { start = { x = 1 }, to = 1, params = { a = linspace(1, 2, 20) } })
print(many)
"""


def refuse_executable_memory():
    if ctypes.CDLL(None, use_errno=True).prctl(PR_SET_MDWE, REFUSE_EXEC_GAIN, 0, 0, 0) != 0:
        raise OSError("no PR_SET_MDWE")


def run(home, **options):
    path = f"{home}/model.lua"
    with open(path, "w", encoding="utf-8") as file:
        file.write(SCRIPT)
    result = subprocess.run([PROGRAM, path], capture_output=True, encoding="utf-8", timeout=4 * PATIENCE, **options)
    check(result.returncode, 0, "status; " + result.stderr)
    return result.stdout


def test_results_are_those_of_machine_code(terminal, home):
    try:
        without = run(home, preexec_fn=refuse_executable_memory)
    except subprocess.SubprocessError:
        print("skipped: this kernel has no PR_SET_MDWE")
        return
    check(without, run(home), "results on the tape")
    check_in("radau", without, "all methods ran")


if __name__ == "__main__":
    names = sys.argv[1:]
    tests = [value for name, value in list(globals().items()) if name.startswith("test_")]
    sys.exit(Suite().run([t for t in tests if not names or any(n in t.__name__ for n in names)]))
