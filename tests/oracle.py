"""What the tests against scipy and mpmath share: finding these libraries, and asking Pendula for matrices."""
import importlib
import os
import subprocess
import sys
import tempfile


def require(*modules):
    """Ends the test as skipped where a module is missing here and in the system's Python (Debian's packages)."""
    try:
        for module in modules:
            importlib.import_module(module)
    except ImportError as e:
        system = "/usr/bin/python3"
        if sys.executable != system and os.path.exists(system) and not os.environ.get("ORACLE"):
            os.environ["ORACLE"] = "1"
            os.execv(system, [system, *sys.argv])
        print(f"skipped: python3-{(e.name or 'scipy').split('.')[0]} is not installed")
        sys.exit(0)


def lua(m):
    """A matrix as a Lua table of rows."""
    import numpy as np
    return "{" + ", ".join("{" + ", ".join(repr(float(v)) for v in row) + "}" for row in np.atleast_2d(m)) + "}"


HEAD = """local function out(v)
  v = evaluate(v)
  if type(v) == "number" then print(("1 1 %.17g"):format(v)) return end
  local m = {}
  for i = 1, v.rows do for j = 1, v.cols do m[#m + 1] = ("%.17g"):format(v(i, j)) end end
  print(v.rows .. " " .. v.cols .. " " .. table.concat(m, " "))
end
local function try(f)
  local ok, v = pcall(f)
  if ok then out(v) else print("error " .. tostring(v):gsub("\\n", " ")) end
end
"""


def lines_of(script, count, timeout):
    """What a script prints: `count` lines, or the test ends as failed."""
    with tempfile.NamedTemporaryFile("w", suffix=".lua", delete=False) as f:
        f.write(script)
    run = subprocess.run([os.environ["PENDULA"], f.name], capture_output=True, text=True, timeout=timeout)
    os.unlink(f.name)
    lines = run.stdout.splitlines()
    if run.returncode or len(lines) != count:
        print("pendula failed:", run.stderr[-800:], len(lines), "of", count)
        sys.exit(1)
    return lines


def values(expressions):
    """Numbers and matrices in Lua -> their values: an array, or the text of the error."""
    import numpy as np
    script = HEAD + "".join(f"try(function() return {expression} end)\n" for expression in expressions)
    found = []
    for line in lines_of(script, len(expressions), 600):
        words = line.split()
        found.append(line if words[0] == "error" else
                     np.array([float(v) for v in words[2:]]).reshape(int(words[0]), int(words[1])))
    return found
