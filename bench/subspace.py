#!/usr/bin/python3
"""n4sid against that of Octave's control package (SLICOT) on the same records, in one run: processor time of the call,
the best of five, and the one-step fit that each model reaches.

    PENDULA=build/release/pendula bench/subspace.py

Bound: at least as fast as Octave. Needs Debian's octave-control; without it only our times are shown."""
import os, re, shutil, subprocess, sys, tempfile

pendula = os.environ.get("PENDULA", "build/release/pendula")
CASES = [(100000, 1, 10), (100000, 2, 10), (10000, 1, 4)]  # samples, outputs and inputs, order

# Damped modes in parallel, driven by all inputs and by noise.
SIMULATE = """
seed(18)
local N, p, n = %d, %d, %d
local modes, x, e, u, y = {}, {}, {}, {}, {}
for k = 1, n // 2 do modes[k], x[k] = { 0.55 * k - 0.2, 0.95 - 0.02 * k }, { 0, 0 } end
for j = 1, p do e[j], u[j], y[j] = randn(N), randn(N), {} end
for t = 1, N do
  for j = 1, p do
    y[j][t] = 0.5 * e[j][t]
    for k = 1, n // 2 do y[j][t] = y[j][t] + (1 + 0.2 * k) * x[k][j] end
  end
  for k, m in ipairs(modes) do
    local c, s, a, b = m[2] * math.cos(m[1]), m[2] * math.sin(m[1]), x[k][1], x[k][2]
    x[k] = { c * a - s * b + 0.5 * u[1][t] + 0.1 * e[1][t], s * a + c * b + 0.3 * u[p][t] + 0.05 * e[p][t] }
  end
end
if p == 1 then y, u = y[1], u[1] end
d = iddata { y = y, u = u, Ts = 1 }
"""
OURS = """
local f, Y, U = assert(io.open("%s", "w")), d.y, d.u
for t = 1, N do
  local row = {}
  for j = 1, p do row[j], row[p + j] = ("%%.17g"):format(Y(t, j)), ("%%.17g"):format(U(t, j)) end
  f:write(table.concat(row, " "), "\\n")
end
f:close()
local best = math.huge
for _ = 1, 5 do
  local from = os.clock()
  m = n4sid(d, { order = n })
  best = math.min(best, os.clock() - from)
end
local y, v = {}, m:predict(d)
for t = 1, N do y[t] = Y(t, 1) end
local mean, error, size = 0, 0, 0
for t = 1, N do mean = mean + y[t] / N end
for t = 1, N do error, size = error + (y[t] - v(t, 1))^2, size + (y[t] - mean)^2 end
print(best, 100 * (1 - math.sqrt(error / size)))
"""
OCTAVE = """
pkg load control
D = load("%s"); p = %d; d = iddata(D(:, 1:p), D(:, p+1:2*p), 1); best = Inf;
for k = 1:5
  c = cputime; [sys, x0, info] = n4sid(d, %d); best = min(best, cputime - c);
end
A = sys.a; B = sys.b; C = sys.c; Dm = sys.d; K = info.K; y = D(:, 1:p); u = D(:, p+1:2*p);
pre = ss(A - K*C, [B - K*Dm, K], C, [Dm, zeros(p)], 1);
yh = lsim(pre, [u y], [], x0); e = y - yh;
printf("%%.6g %%.6g\\n", best, 100*(1 - norm(e(:, 1))/norm(y(:, 1) - mean(y(:, 1)))));
"""


def run(command, text, suffix):
    with tempfile.NamedTemporaryFile("w", suffix=suffix, delete=False) as f:
        f.write(text)
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    done = subprocess.run([*command, f.name], capture_output=True, text=True, timeout=600, env=environment)
    os.unlink(f.name)
    found = re.search(r"^([\d.e+-]+)\s+([\d.e+-]+)$", done.stdout, re.M)
    if not found:
        sys.exit(f"{command[0]}: {done.stderr[-500:]}{done.stdout[-500:]}")
    return float(found[1]), float(found[2])


worst = 0
data = os.path.join(tempfile.mkdtemp(prefix="pendula_subspace_"), "data.txt")
octave = shutil.which("octave-cli")
print("samples  p = m  order   pendula            Octave             ratio")
for samples, p, order in CASES:
    ours = run([pendula], SIMULATE % (samples, p, order) + OURS % data, ".lua")
    line = f"{samples:7}  {p:5}  {order:5}   {1e3 * ours[0]:6.1f} ms {ours[1]:5.2f} %"
    if octave:
        theirs = run([octave, "-q"], OCTAVE % (data, p, order), ".m")
        worst = max(worst, ours[0] / theirs[0])
        line += f"   {1e3 * theirs[0]:6.1f} ms {theirs[1]:5.2f} %   {ours[0] / theirs[0]:.2f}"
    print(line, flush=True)
shutil.rmtree(os.path.dirname(data))
if not octave:
    print("skipped: octave-control is not installed, nothing to compare with")
sys.exit(worst > 1)
