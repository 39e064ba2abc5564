"""save "x.tex" writes documents that pdflatex compiles: models, derivations, tableaus, steps, fits."""
import os
import re
import shutil
import subprocess
import sys
import tempfile

program = os.environ.get("PENDULA", "./pendula")
script = r"""
local x, th, y = vars "x theta y"
local m, M, L, g = params "m=1 M=2 L=1 g=9.81"
local cart = lagrange { q = { x, th }, T = (m + M)/2*x.dot^2 + M*L^2/2*th.dot^2 - L*M*th.dot*x.dot*sin(th),
  V = M*g*L*sin(th), Q = generalized_force({ x, th }, { { vec { x }, vec { param "f" } } }) }
local p = var("p", 3)
local ball = lagrange { q = p, T = m/2*p.dot.T*p.dot, V = m*g*p[3], C = { (p.T*p - L^2)/2 } }
local long = 0
for i = 1, 40 do long = long + param("k" .. i)*sin(y)^i end
local fit = arx(iddata { y = { 1, 2, 4.5, 9, 18 } }, { na = 1 })
local parts = { "\\\\section*{Answers}", cart:trace "every step", cart, cart:semi_explicit(), ball, dae { der(y) ~ long },
  rk.gauss(2), sin(th)^2/cos(th), mat { { x, 1 }, { 0, y } }, fit, explain_step(dae { der(y) ~ -y^3 }, rk.radau(2)) }
for _, form in ipairs { "acc", "ggl", "baumgarte", "project", "dummy", "ode" } do
  parts[#parts + 1] = ball:reduce(form):trace "every step"
  parts[#parts + 1] = ball:reduce(form)
end
parts[#parts + 1] = ball:structure()
parts[#parts + 1] = ball:init { fix = { [p] = { 1, 0, 0 }, [p.dot] = { 0, 1, 0 } } }
parts[#parts + 1] = dae { der(x) ~ y, der(y) ~ -x, 0 ~ x + y }:structure()
local a, z = param "a", var "z"
for _, each in ipairs { solve(y^3 + a*y + 1, y), solve(y^4 + y + 1, y), solve(y^4 + a*y + 1, y), solve(a*y^4 + y^3 - y + 1, y), solve(sin(2*y) ~ 1/2, y), solve(y^2 ~ -4, y),
  solve({ a*y + z ~ 1, y - z ~ a }, { y, z }), equilibria(dae { der(y) ~ a*y - y^3 }), ball.matrix_form,
  ball:constraints(), bdf(4), multistep { name = "ab2", alpha = { 1, -1, 0 }, beta = { 0, "3/2", "-1/2" } },
  explain_step(dae { der(y) ~ z, 0 ~ z + y^3 }, bdf(3)), ball:reduce("array"), ball:reduce("array"):trace() } do
  parts[#parts + 1] = each
end
local d = iddata { y = { 0, 1, 0.5, 2, 1, 0, 1, 3, 1 }, u = { 1, 0, 2, 1, 0, 1, 3, 1, 0 } }
local near = newton { r = { x^2 - y, y - 1 }, x = { x, y }, start = { 2, 1 } }
for _, each in ipairs { near, near:basins { x = { -2, 2 }, y = { -2, 2 }, n = 5 },
  gauss_newton { R = { x - 1, y - 2, x*y - 3 }, x = { x, y }, start = { 1, 1 } },
  dae { der(x) + der(y) ~ x, 0 ~ x - y }:pencil(), lsq({ { 1, 0 }, { 1, 1 }, { 1, 2 } }, { 1, 2, 4 }),
  rk.rk4:stability(), order_conditions(4), rosenbrock.rodas4, tf({ 1 }, { 1, 3, 2 }):poles(),
  margin(tf({ 2 }, { 1, 2, 1, 0 })), eig(mat { { 0, 1 }, { -2, -3 } }),
  compare(d, { arx = arx(d, { na = 1, nb = 1, nk = 1 }) }), arx(d, { na = 1, nb = 1, nk = 1, noise = uniform(-1, 1) }),
  order_scan(d, d, { na = { 1, 2 }, nb = { 1, 1 }, nk = { 1, 1 } }),
  dae { der(y) ~ -y }:integrate { start = { y = 1 }, to = 1 }:check(), cart:structure(), idpoly { A = { 1, a }, B = { 0, 1 } } } do
  local latex = each:latex()
  assert(not latex:find("?", 1, true), latex)
  parts[#parts + 1] = each
end
local wide, rods, C = {}, var("r", 6), {}
for i = 1, 8 do
  wide[i] = {}
  for j = 1, 8 do wide[i][j] = math.sin(i*j) end
end
for k = 1, 3 do
  local a, b = rods:slice(2*k - 1, 2*k), k > 1 and rods:slice(2*k - 3, 2*k - 2) or vec { 0, 0 }
  C[k] = (norm(a - b)^2 - L^2)/2
end
local three = lagrange { q = rods, T = m/2*rods.dot.T*rods.dot, V = m*g*(rods[2] + rods[4] + rods[6]), C = C }
for _, each in ipairs { mat(wide), three.matrix_form, three:reduce "ode", problems.squeezer(),
  explain_step(dae { der(y) ~ z - sin(t), 0 ~ z + y^3 }, rosenbrock.rodas4) } do
  parts[#parts + 1] = each
end
save(arg[1], parts)
"""

with tempfile.TemporaryDirectory() as folder:
    source = os.path.join(folder, "answers.lua")
    with open(source, "w", encoding="utf8") as file:
        file.write(script.replace("\\\\\\\\", "\\\\"))
    tex = os.path.join(folder, "answers.tex")
    subprocess.run([program, source, tex], check=True)
    text = open(tex, encoding="utf8").read()
    for sign in "′″∂δᵀ₁²θωμ":
        assert sign not in text, f"'{sign}' is left in the LaTeX text"
    assert r"\sin^2\theta" in text, text[-400:]
    if not shutil.which("pdflatex"):
        print("pdflatex is not installed (Debian: texlive-latex-base): the document was not compiled")
        sys.exit(0)
    run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "answers.tex"], cwd=folder,
                         capture_output=True, text=True, errors="replace")
    if run.returncode:
        print(run.stdout[-3000:])
    assert run.returncode == 0, "pdflatex fails"
    assert os.path.exists(os.path.join(folder, "answers.pdf"))
    over = [float(by) for by in re.findall(r"Overfull \\hbox \(([\d.]+)pt", run.stdout)]
    assert max(over, default=0) < 30, f"{max(over)} pt run over the edge of the page (its margin has 71 pt)"
print("passed")
