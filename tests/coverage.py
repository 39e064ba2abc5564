"""The share of lines of src that ran, by folder, and files that fall behind: coverage.py root build [floor].

The counters are clang's, of all programs below build, in build/profiles. Ends with 1 where a folder is below the floor.
"""
import collections
import glob
import os
import shutil
import subprocess
import sys

root, build = map(os.path.realpath, sys.argv[1:3])
floor = float(sys.argv[3]) if len(sys.argv) > 3 else 90


def tool(name):
    found = shutil.which(name) or max(glob.glob(f"/usr/lib/llvm-*/bin/{name}"), default=None)
    return found or sys.exit(f"coverage: {name} is missing; Debian's package llvm has it")


def lines_that_ran(merged, programs):
    """file -> line -> did it run? A line of a template ran where one of its instances did. The lines behind
    "if (…) return;" are counted as those before it less the returns. Parent and child share the counters, so that after a
    fork() this is wrong in both: what a child does has to be a function of its own, which does not return."""
    lines = collections.defaultdict(dict)
    for program in programs:  # llvm-cov takes only one count where programs have functions in common
        report = subprocess.Popen([tool("llvm-cov"), "export", "-format=lcov", f"-instr-profile={merged}", program],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        known = None
        for line in report.stdout:
            if line.startswith("SF:"):
                path = os.path.realpath(os.path.join(root, line[3:].strip()))
                known = lines[path] if path.startswith(os.path.join(root, "src") + os.sep) else None
            elif line.startswith("DA:") and known is not None:
                number, count = line[3:].split(",")[:2]
                known[int(number)] = known.get(int(number), False) or int(count) != 0
        report.wait()
    return lines


profiles = glob.glob(os.path.join(build, "profiles", "*.profraw"))
programs = [os.path.join(build, name) for name in ("pendula", "tests/pendula_tests", "tests/pendula_without_gpl")]
merged = os.path.join(build, "profiles", "all.profdata")
subprocess.run([tool("llvm-profdata"), "merge", "-sparse", "-failure-mode=all", "-o", merged, *profiles], check=True)
lines = lines_that_ran(merged, [program for program in programs if os.path.exists(program)])

folders = collections.defaultdict(lambda: [0, 0])
for path, known in lines.items():
    for folder in (os.path.relpath(os.path.dirname(path), root), "src: all of it"):
        folders[folder][0] += sum(known.values())
        folders[folder][1] += len(known)
for folder, (ran, count) in sorted(folders.items()):
    print(f"{100*ran/max(1, count):6.1f} %  {ran:6} of {count:6}  {folder}")
low = [folder for folder, (ran, count) in sorted(folders.items()) if 100*ran < floor*count and ":" not in folder]
for path, known in sorted(lines.items()):
    if os.path.relpath(os.path.dirname(path), root) in low:
        missing = sorted(number for number, ran in known.items() if not ran)
        print(f"  {os.path.relpath(path, root)}: {len(missing)} of {len(known)} did not run: {missing}")
print(f"{len(low)} of {len(folders) - 1} folders below {floor:g} %" + (": " + ", ".join(low) if low else ""))
sys.exit(1 if low else 0)
