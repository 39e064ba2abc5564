#!/usr/bin/python3
"""Runs the fuzzers for so many seconds and counts: run.py seconds [program]. A finding names the command that shows it."""
import os
import re
import subprocess
import sys
import tempfile
import time

import seeds

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60
program = sys.argv[2] if len(sys.argv) > 2 else os.environ.get("PENDULA", os.path.join(ROOT, "build/release/pendula"))
first = int(os.environ.get("FUZZ_SEED", "1"))
reader = os.environ.get("FUZZ_READER")  # the libFuzzer program, where it was built
work = tempfile.mkdtemp(prefix="pendula-fuzz-")
findings, counts = [], {}


def count(what, number):
    counts[what] = counts.get(what, 0) + number


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
    done = subprocess.run([program, "-e", "for name in pairs(pendula) do pcall(examples, name) end"],
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
    """One process; its working folder is empty, so that calls that write files write them there."""
    command = [program, os.path.join(ROOT, "tests/fuzz", script), str(seed), str(number), *extra]
    environment = dict(os.environ, NO_COLOR="1", ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1")
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=limit, cwd=work,
                              stdin=subprocess.DEVNULL, env=environment)
    except subprocess.TimeoutExpired:
        findings.append(f"no end within {limit} s: {' '.join(command)}{at_work()}")
        return 0
    last = done.stdout.strip().splitlines()[-1:] or [""]
    if done.returncode != 0:
        findings.append(f"status {done.returncode}: {' '.join(command)}\n  {last[0]}\n  {done.stderr.strip()[-600:]}{at_work()}")
        return 0
    return int(re.match(r"(\d+)", last[0]).group(1)) if last[0] else 0


begin = time.time()
if reader:
    corpus = os.path.join(work, "corpus")
    os.mkdir(corpus)
    seeds.write(corpus)
    share = max(1, int(seconds/3))
    done = subprocess.run([reader, f"-max_total_time={share}", "-max_len=4000", "-timeout=20", "-rss_limit_mb=6000",
                           f"-artifact_prefix={work}/", corpus],
                          capture_output=True, text=True, errors="replace")
    runs = re.findall(r"^#(\d+)", done.stderr, re.M)
    count("inputs of readers", int(runs[-1]) if runs else 0)
    if done.returncode != 0:
        findings.append(f"reader: status {done.returncode}\n{done.stderr[-1500:]}")
names, shown, seed = words(), examples(), first
last = int(os.environ.get("FUZZ_LAST", "1000000000"))
while time.time() - begin < seconds and len(findings) < 20 and seed <= last:
    count("calls", attempt("calls.lua", seed, 1500, [names], 300))
    count("changed examples", attempt("examples.lua", seed, 300, [shown], 300))
    count("numerical runs", attempt("numbers.lua", seed, 15, [], 300))
    seed += 1
print(f"{time.time() - begin:.0f} s, seeds {first} … {seed - 1}: "
      + ", ".join(f"{number} {what}" for what, number in counts.items()) + f", {len(findings)} findings")
for finding in findings:
    print(finding)
sys.exit(1 if findings else 0)
