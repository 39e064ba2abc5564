"""Every kind of object has LaTeX that pdflatex compiles with amsmath, or refuses in words that help."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

program = os.environ.get("PENDULA", "./pendula")
root = pathlib.Path(__file__).resolve().parents[2]

preparation = r"""
x, y = vars "x y"
k, a, b = param("k", 1), params "a b"
decay = dae{ der(x) ~ -k*x }
turning = dae{ der(x) ~ y, der(y) ~ -x }
sol = turning:integrate{ start = { x = 1, y = 0 }, to = 3 }
p = var("p", 3)
ball = lagrange{ q = p, T = p.dot.T*p.dot/2, V = 9.81*p[3], C = { (p.T*p - 1)/2 } }
G = tf({ 1 }, { 1, 1, 2 })
u, v = {}, prbs(127)
for i = 1, 127 do u[i] = 0.5*(u[i - 1] or 0) + v[math.max(1, i - 1)] + (i % 7)/10 end
d = iddata{ y = u, u = v }
few = iddata{ y = { 2.02, 1.49, 1.09, 0.83, 0.59, 0.46 }, Ts = 1 }
r = fit(decay, { params = { k }, data = few, y = x, start = { x = 2 } })
function varied(design, runs)
  return sweep(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, runs = runs or 16, design = design })
end
Y, U = func "y", func "u"
joint = normal({ 0, 0 }, { { 1, 0.5 }, { 0.5, 1 } })
m = arx(d, { na = 1, nb = 1, nk = 1 })
el = components.electrical
near = newton{ r = { x^2 - y, y - 1 }, x = { x, y }, start = { 2, 1 } }
eigen = { { 0, 1 }, { -2, -3 } }
"""

results = {                                            # kind: an object of it
    "basins": "near:basins{ x = { -2, 2 }, y = { -2, 2 }, n = 5 }",
    "bootstrap_result": "r:bootstrap{ runs = 10, workers = 1 }",
    "chaos": 'varied "halton":chaos(x, { degree = 2 })',
    "check": "sol:check()",
    "coherence": "coherence(d)",
    "comparison": "compare(d, { arx = m })",
    "complex": "G:poles()[1]",
    "conditions": "rk.rk4:conditions(5)",
    "constraints": "ball:constraints()",
    "continuous model": "tfest(d, { np = 1, nz = 0 })",
    "convergence": "converge(decay, { start = { x = 1 }, to = 2, methods = { rk.rk4, rk.heun }, "
                   "dt = { 0.2, 0.1, 0.05 }, exact = exp(-t) })",
    "cross_validation": "r:cross_validate{ folds = 3, workers = 1 }",
    "damping": "G:damp()",
    "delay system": "delayed(G, 2)",
    "density": "density(function(e) return 1/(1 + e^2)^2 end)",
    "distribution": "normal(1e-7, 2.5e-4)",
    "drift": "ball:reduce 'acc':integrate{ start = { p = { 1, 0, 0 }, [p.dot] = { 0, 1, 0 } }, to = 1 }:drift()",
    "eigenvalues": "eig(mat(eigen))",
    "equation": "x^2 ~ 1e-9*y",
    "equilibria": "equilibria(dae{ der(x) ~ k*x - x^3 })",
    "equilibrium": "equilibria(dae{ der(x) ~ k*x - x^3 })[1]",
    "expr": "sin(x)^2/sqrt(1 + y^2)",
    "filtered states": "ekf(dae{ der(x) ~ -x }, { data = iddata{ y = { 1, 0.4, 0.2 }, Ts = 1 }, y = x, start = { x = 1 },"
                       " P0 = eye(1), Q = eye(1), R = eye(1) })",
    "fit_result": "r",
    "forecast": "arx(iddata{ y = u }, { na = 2 }):forecast(iddata{ y = u }, 3)",
    "frequency response": "bode(G)",
    "func": 'func "f"',
    "gauss_newton": "gauss_newton{ R = { x - 1, y - 2, x*y - 3 }, x = { x, y }, start = { 1, 1 } }",
    "hammerstein wiener": "hammerstein(d, { nb = 1, nf = 1, input = { function(v) return v end } })",
    "iddata": "d",
    "idmodel": "m",
    "idpoly": "idpoly{ A = { 1, a }, B = { 0, 1 } }",
    "impulse estimate": "impulse_estimate(d, { lags = 4 })",
    "joint_component": "joint[1]",
    "joint_distribution": "joint",
    "kalman_result": "kalman_filter(ss({ { 1 } }, { 0 }, { 1 }, { 0 }, 1), 0, 1, { y = { 1, 3 }, P0 = 9 })",
    "lsq_result": "lsq({ { 1, 0 }, { 1, 1 }, { 1, 2 } }, { 1, 2, 4 })",
    "lti": "ss(G)",
    "lti_stability": "G:stability()",
    "margins": "margin(tf({ 2 }, { 1, 2, 1, 0 }))",
    "matrix": "randn(3, 14)",
    "matrix_form": "ball.matrix_form",
    "model": "ball",
    "morris_effects": 'varied("morris", 20):morris(x)',
    "multistep": "bdf(4)",
    "newton": "near",
    "order_conditions": "order_conditions(4)",
    "nlsq_result": "nlsq(function(p) return { p[1] - 1, p[1] - 2 } end, { 1 })",
    "order_scan_result": "order_scan(d, d, { na = { 1, 2 }, nb = { 1, 1 }, nk = { 1, 1 } })",
    "parameter_set": "arx(d, { na = 1, nb = 1, nk = 1, noise = uniform(-2, 2) })",
    "pencil": "dae{ der(x) + der(y) ~ x, 0 ~ x - y }:pencil()",
    "power density": "welch(u)",
    "predictor": "predictor(a*Y(t - 1) + b*U(t - 1))",
    "predictor_fit": "predictor(a*Y(t - 1) + b*U(t - 1)):fit(d)",
    "probability": 'varied "monte carlo":probability(lt(x, 0.5))',
    "profile_result": "r:profile(k, { points = 5, workers = 1 })",
    "random_process": "random_process{ band = { 0.1, 5 }, std = 2 }",
    "reachability": "ss(G):controllability()",
    "recursive estimate": "rarx(d, { na = 1, nb = 1, nk = 1 })",
    "reliability_result": "reliability(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, "
                          "limit_state = x - 0.35, runs = 100 })",
    "response": "step(G)",
    "roots": "roots(x^3 - 2, x)",
    "rosenbrock": "rosenbrock.rodas4",
    "slurm": 'slurm{ tasks = 4, time = "10min" }',
    "sobol_indices": 'varied "saltelli":sobol(x, { bootstrap = 5 })',
    "solution": "sol",
    "solutions": "solve({ x + y ~ a, x - y ~ b }, { x, y })",
    "spectral estimate": "spa(d)",
    "spectrum": "periodogram(u)",
    "stability_function": "rk.gauss(2):stability()",
    "start": "turning:init{ fix = { x = 1, y = 0 } }",
    "starts_result": "r:starts{ runs = 2, workers = 1 }",
    "stats": "sol:stats()",
    "step": "explain_step(ball:reduce 'acc', rk.radau(2))",
    "structure": "ball:structure()",
    "sweep": 'varied "sobol"',
    "sweep_stats": 'varied "sobol":stats()',
    "symbolic tableau": "tableau{ A = { { 0, 0 }, { a, 0 } }, b = { 0, 1 } }",
    "tableau": "rk.gauss(2)",
    "trace": "ball:reduce 'ggl':trace 'every step'",
    "uncertain system": "uncertain(m)",
    "validation": "m:validate(d)",
    "validations": "fir(iddata{ y = { d.y, d.y }, u = d.u }, { nb = 1 }):validate(iddata{ y = { d.y, d.y }, u = d.u })",
    "verification": "rk.heun:verify()",
}
refused = {                                            # kind: an object, and what the error says
    "animation": ("animate(sol, { vec{ x, y } })", "no LaTeX text"),
    "figure": ("plot({ 1, 2 }, { 3, 4 })", "includegraphics"),
    "fn": ("fn({ x, y }, x*y)", "take the expression"),
    "lookup": ("lookup{ x = { 0, 1 }, y = { 0, 1 } }", "take the expression"),
    "surface": ("surface(function(x, y) return x*y end, { 0, 1 }, { 0, 1 }, 4)", "includegraphics"),
    "prepared run": ("decay:prepare{}", "no LaTeX text"),
    "part": ("el.resistor{}", "is not a model by itself"),
    "connector": ("el.pin", "has no field 'latex'"),
    "problem": ("problems.pendulum", "has no field 'latex'"),
}
more = [                                               # of the same kinds, where the text is another one
    "ball:reduce 'ggl'", "ball:reduce 'dummy':trace()", "uniform(-1, 2)", "triangular(0, 1, 2)", "tf({ 1 }, { 1, 0 }, 0.1)", "ss(G):poles()[2]",
    "ball:reduce 'acc':integrate{ start = { p = { 1, 0, 0 }, [p.dot] = { 0, 1, 0 } }, to = 1 }",
    "dae{ der(var 'x_1') ~ 1 }:integrate{ start = { x_1 = 0 }, to = 1e-5 }", "eig(mat{ { 0, 1 }, { -1, 0 } })",
    "ss(eye(12)*(-1), ones(12, 1), ones(1, 12))", "zeros(12, 12)", "tf({ k }, { 1, a, b }):stability()", "sweep(decay, { start = { x = 1 },"
    " to = 1, params = { k = { 1, 2 } } })", "dae{ der(x) ~ -x }:linearize(dae{ der(x) ~ -x }:init{ fix = { x = 1 } })",
]

# What no script holds or no answer is made of.
not_results = {"virtual_work", "component", "connection", "pin", "library", "expectation", "problems", "equations"}


def kinds_in_sources():
    names = set()
    for path in (root / "src" / "lua").rglob("*.[ch]pp"):
        names |= set(re.findall(r'TypeName<[^>]*> \{\s*static constexpr const char\* value = "([^"]+)"', path.read_text()))
    for path in (root / "stdlib").rglob("*.lua"):
        text = path.read_text()
        names |= set(re.findall(r'\brecord\("([^"]+)"', text)) | set(re.findall(r'__name = "([^"]+)"', text))
    return names


untested = kinds_in_sources() - set(results) - set(refused) - not_results
assert not untested, f"no LaTeX is tried of {sorted(untested)}: add an object to this test"

script = preparation + r"""
local parts, faults = {}, {}
local function check(fault, kind, text)
  if fault then faults[#faults + 1] = kind .. ": " .. tostring(text) end
  return not fault
end
local function add(kind, make)
  local made, value = pcall(make)
  if not check(not made, kind, value) then return end
  local good, latex = pcall(function() return value:latex() end)
  if not check(not good or latex:find("[?\128-\255]"), kind, latex) then return end
  parts[#parts + 1] = "\\subsection*{" .. kind:gsub("_", "\\_") .. "}"
  parts[#parts + 1] = value
end
local function refuses(kind, words, make)
  local value = make()
  local good, text = pcall(function() return value:latex() end)
  check(good or not tostring(text):find(words, 1, true), kind, text)
end
""" + "".join(f'add("{kind}", function() return {value} end)\n' for kind, value in results.items()) \
    + "".join(f'add("{i}", function() return {value} end)\n' for i, value in enumerate(more)) \
    + "".join(f'refuses("{kind}", "{words}", function() return {value} end)\n'
              for kind, (value, words) in refused.items()) \
    + 'if #faults > 0 then error(table.concat(faults, "\\n\\n"), 0) end\nsave(arg[1], parts)\n'

with tempfile.TemporaryDirectory() as folder:
    source = os.path.join(folder, "kinds.lua")
    pathlib.Path(source).write_text(script, encoding="utf8")
    run = subprocess.run([program, source, os.path.join(folder, "kinds.tex")], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr + run.stdout
    if not shutil.which("pdflatex"):
        print("pdflatex is not installed (Debian: texlive-latex-base): the document was not compiled")
        sys.exit(0)
    run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "kinds.tex"], cwd=folder,
                         capture_output=True, text=True, errors="replace")
    assert run.returncode == 0, run.stdout[-3000:]
    if shutil.which("gnuplot"):                        # a figure is a PDF file beside the document
        answer = os.path.join(folder, "answer.tex")
        lines = f'save("{answer}", {{ "text", plot({{ 1, 4, 9 }}), rk.rk4 }})'
        subprocess.run([program, "-e", lines], check=True)
        run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "answer.tex"], cwd=folder,
                             capture_output=True, text=True, errors="replace")
        assert run.returncode == 0 and os.path.exists(os.path.join(folder, "answer-1.pdf")), run.stdout[-2000:]
    run = subprocess.run([program, "-e", 'save("x.tex", { print })'], capture_output=True, text=True, cwd=folder)
    assert "a function has no latex(); a .tex file takes" in run.stderr, run.stderr
    if len(sys.argv) > 1:
        shutil.copy(os.path.join(folder, "kinds.pdf"), sys.argv[1])
print("passed")
