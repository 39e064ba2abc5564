"""What the readers' fuzzer begins with, and what it has found, goes through the readers of the program as it is built here,
whole, cut short and with bytes changed: no crash, no hang, no internal error."""
import os
import random
import subprocess
import sys
import tempfile

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, here)
import seeds  # noqa: E402

READERS = """
local readers = {
  function(file) return load(file) end, function(file) return tableau(assert(io.open(file, "rb")):read "a") end,
  function(file) return iddata.read(file, { y = 1, Ts = 1 }) end,
  function(file) return iddata.read(file, { y = "y", Ts = 1 }) end,
  function(file) local text = assert(io.open(file, "rb")):read "a" return rational(text) end,
  function(file) local f = loadfile(file) return f ~= nil end }
local endings = { ".lua", ".txt", ".csv", ".mat", ".txt", ".txt" }
for line in io.lines(arg[1]) do
  local path, kind = line:match "^(.*) (%d)$"
  local good, text = pcall(readers[kind + 1], path .. endings[kind + 1])
  if not good and (tostring(text) == "" or tostring(text):find("please report", 1, true)) then
    error(path .. ": " .. tostring(text), 0)
  end
end
print "read"
"""
ENDINGS = (".lua", ".txt", ".csv", ".mat", ".txt", ".txt")
with tempfile.TemporaryDirectory() as work:
    random.seed(3)
    rows = []
    for reader, whole in seeds.SEEDS:
        for change in range(30):
            data = bytearray(whole)
            if change > 20:
                del data[random.randrange(len(data)):]
            for _ in range(min(change, len(data))):
                data[random.randrange(len(data))] = random.choice((0, 1, 10, 34, 44, 127, 255, random.randrange(256)))
            path = os.path.join(work, f"input{len(rows)}")
            with open(path + ENDINGS[reader], "wb") as file:
                file.write(data)
            rows.append(f"{path} {reader}\n")
    for name, text in (("readers.lua", READERS), ("list", "".join(rows))):
        with open(os.path.join(work, name), "w") as file:
            file.write(text)
    done = subprocess.run([os.environ["PENDULA"], os.path.join(work, "readers.lua"), os.path.join(work, "list")], timeout=100,
                          capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
    assert done.returncode == 0 and "read" in done.stdout, done
    print(f"{len(rows)} inputs")
