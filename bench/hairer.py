#!/usr/bin/python3
"""Hairer's DOP853 and RADAU5 beside Pendula in one run, at the same digits: the ratio of their times.

    /usr/bin/python3 bench/hairer.py [words of a name]

needs the Debian packages gcc, python3-scipy, r-cran-desolve and build/release/pendula. Both codes are those that
Debian compiles; their right-hand sides and Jacobians are C, written by hand (bench/hairer/models.c), for the explicit
equations that a person derives. The digits at a tolerance are partly luck: counted is the line through the logarithms
of the times at those tolerances 10^(-k/2) at which a code reaches up to one and a half digits less and more than
asked for, or the least time at which it reaches still more. Runs alternate, the least time of each counts. Above 1
Pendula is faster. Pendula's time begins with its first step, behind the choice of a method; that of the codes has the
choice of the first step in it.
"""
import math
import os
import subprocess
import sys
import tempfile

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(here, "hairer"))

import numpy as np
from peers import Peers

pendula = os.path.join(here, "..", "build", "release", "pendula")
script = os.path.join(here, "hairer.lua")


def ours(*arguments):
    out = subprocess.run([pendula, script, *map(str, arguments)], capture_output=True, text=True, check=False)
    if out.returncode:
        return None
    return dict(line.split(None, 1) for line in out.stdout.splitlines())


def brusselator(n):
    y = np.empty(2 * n)
    y[0::2], y[1::2] = 1 + np.sin(2 * np.pi * np.arange(1, n + 1) / (n + 1)), 3
    return y


def heat(n):
    k = np.arange(1, n + 1) / (n + 1)
    y, x = np.meshgrid(k, k, indexing="ij")
    return (16 * x * (1 - x) * y * (1 - y) * np.exp(x)).ravel()


def particles(n):
    i = np.arange(1, n + 1)
    z, phi = 1 - (2 * i - 1) / n, (i - 1) * np.pi * (3 - math.sqrt(5))
    x, y, w = np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), (1 + z) / 2
    return np.concatenate([x, y, z, -w * y, w * x, 0 * z])


def akzo():
    y = np.zeros(400)
    y[1::2] = 1
    return y


burgers = np.arange(1, 501) / 501
grid = {"u%d" % k: k - 1 for k in range(1, 2501)}
pair = {c + str(k): 2 * (k - 1) + p for k in range(1, 501) for p, c in enumerate("uv")}
angles = list("βθγφδΩε")
squeezer = [-0.0617138900142765, 0, 0.45527981916307, 0.222668390165886, 0.487364979543843, -0.222668390165886,
            1.23054744454982]
# name of the problem, the C function, times between which it is smooth, start, unknown -> place, atol/rtol, and for
# RADAU5 the band below and above the diagonal
dop853, radau5 = "DOP853", "RADAU5"
problems = [
    (dop853, "Arenstorf orbit", "arenstorf", [0, 17.0652165601579625588917206249],
     [0.994, 0, 0, -2.00158510637908252240537862224], {"x": 0}, 1),
    (dop853, "Pleiades", "pleiades", [0, 3],
     [3, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4, 0, 0, 0, 0, 0, 1.75, -1.5, 0, 0, 0, -1.25, 1, 0, 0],
     {"x1": 0, "y1": 7, "u1": 14, "x7": 6, "y7": 13}, 1),
    (dop853, "squeezer", "squeezer", [0, 0.03], squeezer + 7 * [0], dict(zip(angles, range(7))), 1),
    (dop853, "particles", "particles", [0, 5], particles(20), {"x1": 0, "y1": 20, "z20": 59}, 1),
    (dop853, "Burgers, 500 points", "burgers", [0, 2.5], 1.5 * burgers * (1 - burgers) ** 2, grid, 1),
    (dop853, "heat, 20 × 20", "heat", [0, 0.5], heat(20), grid, 1),
    (dop853, "heat, 50 × 50", "heat", [0, 0.5], heat(50), grid, 1),
    (radau5, "beam of 40 pieces", "beam", [0, math.pi, 5], 80 * [0], {"th1": 0, "th40": 39}, 1, None, None, 40),
    (radau5, "Brusselator, 40 points", "brusselator", [0, 10], brusselator(40), pair, 1, 2, 2),
    (radau5, "Brusselator, 500 points", "brusselator", [0, 10], brusselator(500), pair, 1, 2, 2),
    (radau5, "Burgers, 500 points", "burgers", [0, 2.5], 1.5 * burgers * (1 - burgers) ** 2, grid, 1, 1, 1),
    (radau5, "heat, 20 × 20", "heat", [0, 0.5], heat(20), grid, 1, 20, 20),
    (radau5, "heat, 50 × 50", "heat", [0, 0.5], heat(50), grid, 1, 50, 50),
    (radau5, "Medical Akzo Nobel", "akzo", [0, 5, 20], akzo(), pair, 1e-6, 2, 2),
]


levels, margin, rounds = (4, 6, 8, 10), 1.5, 3


def digits(values, reference):
    worst = max(abs((values[k] - v) / v) for k, v in reference.items())
    return -math.log10(max(worst, 1e-16)) if worst == worst else 0


def peer_run(peers, problem, rtol):
    code, _, function, times, start, places, share, *band = problem
    call = peers.dop853 if code == dop853 else peers.radau5
    seconds, y = call(function, times, np.array(start, float), rtol, share * rtol, *band)
    return seconds, None if y is None else {name: y[k] for name, k in places.items() if k < len(y)}


def our_run(name, rtol, repeats=1):
    found = ours("run", name, "default", rtol, repeats)
    if not found:
        return math.inf, None, ""
    return (float(found.pop("seconds")), {k: float(v) for k, v in found.items() if k != "method"},
            found["method"])


def reached(run, reference):
    """Tolerances with the digits reached."""
    found = []
    for k in range(3, 2*max(levels) + 10):
        values = run(10 ** (-k / 2))
        found.append((10 ** (-k / 2), digits(values, reference) if values else 0))
        if found[-1][1] > max(levels) + margin:
            break
    return found


def time_at(level, points):
    """Of points (digits, seconds); None where the digits are not reached."""
    more = [seconds for got, seconds in points if got > level + margin]
    near = [(got - level, math.log(seconds)) for got, seconds in points if abs(got - level) <= margin]
    if len(near) > 2 and max(near)[0] >= 0:
        slope, value = np.polyfit(*zip(*near), 1)
        more.append(math.exp(value if slope > 0 and min(near)[0] < 0 else np.mean([log for _, log in near])))
    return min(more, default=None)


def measure(peers, problem):
    code, name = problem[0], problem[1]
    reference = {k: float(v) for k, v in (ours("reference", name) or {}).items()}
    reference = reference or peer_run(peers, problem, 3e-14)[1]
    theirs = reached(lambda r: peer_run(peers, problem, r)[1], reference)
    mine = reached(lambda r: our_run(name, r)[1], reference)
    repeats = {r: int(min(1000, max(2, 0.15 / our_run(name, r, 3)[0]))) for r, _ in mine}
    least, best, methods = {}, {}, {}
    for _ in range(rounds):
        for r, got in mine:
            seconds, _, methods[r] = our_run(name, r, repeats[r])
            best[r, got] = min(best.get((r, got), math.inf), seconds)
        for r, got in theirs:
            runs = [peer_run(peers, problem, r)[0]]
            runs += [peer_run(peers, problem, r)[0] for _ in range(int(min(30, 0.05 / runs[0])))]
            least[r, got] = min([least.get((r, got), math.inf), *runs])
    for level in levels:
        his = time_at(level, [(got, seconds) for (_, got), seconds in least.items()])
        our = time_at(level, [(got, seconds) for (_, got), seconds in best.items()])
        if not his or not our:
            print(f"{name:26}{level:3}  not reached by {code if not his else 'Pendula'}", flush=True)
            continue
        nearest = min(mine, key=lambda entry: abs(entry[1] - level))[0]
        print(f"{name:26}{level:3}  {code} {his*1e3:9.3f} ms   Pendula {our*1e3:9.3f} ms   {his/our:6.2f}"
              f"  {methods[nearest]}", flush=True)


def main():
    wanted = " ".join(sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        library = os.path.join(folder, "models.so")
        subprocess.run(["gcc", "-O3", "-march=native", "-ffp-contract=fast", "-fPIC", "-shared",
                        os.path.join(here, "hairer", "models.c"), "-o", library, "-lm"], check=True)
        peers = Peers(library)
        for problem in problems:
            if wanted.lower() in (problem[0] + " " + problem[1]).lower():
                measure(peers, problem)


main()
