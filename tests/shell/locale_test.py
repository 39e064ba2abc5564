"""Numbers have a decimal point in everything that is written and read, whatever the locale of the user or os.setlocale says:
the texts and files of a run under a locale with a decimal comma are those of a run without."""
import filecmp
import os
import subprocess
import tempfile

PROGRAM = os.environ["PENDULA"]
COMMA = 'LC_NUMERIC\ndecimal_point ","\nthousands_sep "."\ngrouping 3;3\nEND LC_NUMERIC\n'
SCRIPT = """
x, k = var "x", param("k", 0.25)
local function everything(name)
  local m = dae{ der(x) ~ -k*x + 0.125 }
  local s = m:integrate{ start = { x = 1.5 }, to = 1.75 }
  print(name, 1.5, 1234567.25, x*1.25, vec{ 0.5, 1e-3 }, mat{ { 1.5, 2 }, { 3, 4.25 } }, tf({ 1.5 }, { 1, 0.5 }))
  print(("%.3f %g"):format(1/3, 2.5), tostring(2.5), tonumber "1.5", tonumber "1,5", load "return 1.5 + 0x.8p0"())
  print(m, s, s:stats(), latex(m), (x*1.25):code(), rational "1.25", json(s), m:json())
  s:csv(name .. ".csv")
  print(iddata.read(name .. ".csv", { y = 2, Ts = 0.1 }))
  save(name .. "-model.lua", m)
  save(name .. "-values.lua", { 1.5, a = 2.25 })
  print(load(name .. "-model.lua"), load(name .. "-values.lua").a)
  plot(s.t, s(x)):save(name .. ".svg")
end
everything "start"
for _, category in ipairs{ "all", "numeric" } do
  os.setlocale("", category)
  everything(category)
end
"""


def run(folder, **environment):
    os.mkdir(folder)
    done = subprocess.run([PROGRAM, "-e", SCRIPT], cwd=folder, capture_output=True, text=True, timeout=100,
                          env=dict(os.environ, **environment))
    assert done.returncode == 0, done
    return done.stdout


with tempfile.TemporaryDirectory() as work:
    with open(os.path.join(work, "source"), "w") as file:
        file.write(COMMA)
    # It warns of all the categories that the source does not have. The character set is there where Debian's "locales" is.
    made = any(subprocess.run(["localedef", "-c", "--no-archive", "-i", "source", *charset, "./comma"], cwd=work,
                              capture_output=True).returncode < 2 for charset in (["-f", "UTF-8"], []))
    comma = {"LOCPATH": work, "LC_ALL": "comma", "LANG": "comma"}
    told = subprocess.run(["/usr/bin/python3", "-c", "import locale; locale.setlocale(locale.LC_ALL, ''); print(locale.str(1.5))"],
                          env=dict(os.environ, **comma), capture_output=True, text=True).stdout
    assert made and told == "1,5\n", f"no locale with a decimal comma could be made: {told}"
    here, there = os.path.join(work, "here"), os.path.join(work, "there")
    expected, got = run(here), run(there, **comma)
    assert "1234567.25" in expected and got == expected, got
    names = sorted(os.listdir(here))
    assert len(names) == 12 and filecmp.cmpfiles(here, there, names, shallow=False)[0] == names, os.listdir(there)
    print(f"{len(names)} files and {len(got.splitlines())} lines")
