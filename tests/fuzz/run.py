#!/usr/bin/python3
"""Runs the fuzzers for so many seconds and counts. A finding names the command that shows it.

    run.py seconds [program [generator ...]]        generators: calls examples numbers
                                                   algebraic narrow; all where none is named

Environment: FUZZ_SEED and FUZZ_LAST, the seeds; FUZZ_SIZE, how many times the work of one process; FUZZ_READER, the
program of libFuzzer, which takes a third of the time; FUZZ_FINDINGS, after how many findings to stop.
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import seeds

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60
program = sys.argv[2] if len(sys.argv) > 2 else os.environ.get("PENDULA", os.path.join(ROOT, "build/release/pendula"))
generators = sys.argv[3:] or ["calls", "examples", "numbers", "algebraic", "narrow"]
first = int(os.environ.get("FUZZ_SEED", "1"))
size = int(os.environ.get("FUZZ_SIZE", "1"))
reader = os.environ.get("FUZZ_READER")  # the libFuzzer program, where it was built
work = tempfile.mkdtemp(prefix="pendula-fuzz-")
findings, counts = [], {}


def count(what, number):
    counts[what] = counts.get(what, 0) + number


def found(text):
    findings.append(text)
    print(text, flush=True)


def words():
    """The names of methods and fields, from the help pages of all types."""
    found = set()
    for kind in ("expr matrix equation model solution tableau lti iddata idmodel figure start constraints structure "
                 "pencil stats drift roots newton multistep check").split():
        done = subprocess.run([program, "-e", f'help "{kind}"'], capture_output=True, text=True, timeout=60)
        found.update(re.findall(r"^  \w+[:.](\w+)", done.stdout, re.M))
    path = os.path.join(work, "words")
    with open(path, "w") as file:
        file.write("\n".join(sorted(found - {"save", "csv"})) + "\n")
    return path


def examples():
    """The examples of the documentation, as the session shows them."""
    done = subprocess.run([program, "-e", "local names = {}; for name in pairs(pendula) do names[#names + 1] = name end; "
                           "table.sort(names); for _, name in ipairs(names) do pcall(examples, name) end"],
                          capture_output=True, text=True, timeout=120)
    path = os.path.join(work, "examples.txt")
    with open(path, "w") as file:
        file.write(done.stdout)
    return path


def at_work():
    """What examples.lua was running."""
    path = os.path.join(work, "last.lua")
    if not os.path.exists(path):
        return ""
    with open(path) as file:
        code = file.read()
    os.remove(path)
    return "\n  " + code.replace("\n", "\n  ")


def attempt(script, seed, number, extra, limit):
    """One process, of so many seconds of processor time; its working folder is empty, so that calls that write files
    write them there."""
    command = [program, os.path.join(ROOT, "tests/fuzz", script), str(seed), str(number), *extra]
    environment = dict(os.environ, NO_COLOR="1", ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1")
    try:
        done = subprocess.run(["/bin/bash", "-c", f'ulimit -t {limit}; exec "$@"', "run", *command], capture_output=True,
                              text=True, errors="replace", timeout=20*limit, cwd=work, stdin=subprocess.DEVNULL,
                              env=environment)
    except subprocess.TimeoutExpired:
        found(f"no end within {20*limit} s: {' '.join(command)}{at_work()}")
        return 0
    last = done.stdout.strip().splitlines()[-1:] or [""]
    if -done.returncode in (signal.SIGXCPU, signal.SIGKILL):
        found(f"no end within {limit} s of processor time: {' '.join(command)}{at_work()}")
    elif done.returncode != 0:
        found(f"status {done.returncode}: {' '.join(command)}\n  {last[0]}\n  {done.stderr.strip()[-600:]}{at_work()}")
    counted = re.match(r"(\d+)", last[0])
    return int(counted.group(1)) if done.returncode == 0 and counted else 0


begin = time.time()
if reader:
    # Inputs that reached new code are kept beside the program: the next run begins where this one ended.
    corpus = os.environ.get("FUZZ_CORPUS", os.path.join(os.path.dirname(program), "corpus"))
    os.makedirs(corpus, exist_ok=True)
    seeds.write(corpus)
    share = max(1, int(seconds/3))
    done = subprocess.run([reader, f"-max_total_time={share}", "-max_len=4000", "-timeout=20", "-rss_limit_mb=6000",
                           f"-artifact_prefix={work}/", corpus],
                          capture_output=True, text=True, errors="replace",
                          env=dict(os.environ, ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1"))
    runs = re.findall(r"^#(\d+)", done.stderr, re.M)
    count("inputs of readers", int(runs[-1]) if runs else 0)
    inside = re.search(r"ERROR: AddressSanitizer|runtime error:", done.stderr)  # in the process that reads MATLAB files
    if done.returncode != 0 or inside:
        found(f"reader: status {done.returncode}\n{done.stderr[-1500:]}")
work_of = {  # generator: what it counts, its script, how much a process does, its further arguments
    "calls": ("calls", "calls.lua", 1500, lambda: [words()]),
    "examples": ("changed examples", "examples.lua", 300, lambda: [examples()]),
    "numbers": ("numerical runs", "numbers.lua", 15, lambda: []),
    "algebraic": ("runs with z", "numbers.lua", 8, lambda: ["z"]),
    "narrow": ("runs with narrow features", "numbers.lua", 8, lambda: ["narrow"]),
}
rows = [(what, script, number*size, extra()) for what, script, number, extra in map(work_of.get, generators)]
seed, last = first, int(os.environ.get("FUZZ_LAST", "1000000000"))
while time.time() - begin < seconds and len(findings) < int(os.environ.get("FUZZ_FINDINGS", "20")) and seed <= last:
    for what, script, number, extra in rows:
        count(what, attempt(script, seed, number, extra, 100*max(1, size//3)))
    seed += 1
print(f"{time.time() - begin:.0f} s, seeds {first} … {seed - 1}: "
      + ", ".join(f"{number} {what}" for what, number in counts.items()) + f", {len(findings)} findings")
if not findings:
    shutil.rmtree(work)
sys.exit(1 if findings else 0)
