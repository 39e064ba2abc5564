"""pendula grade: right answers in every notation, and wrong ones of those who look for points without knowledge."""
import json
import os
import subprocess
import tempfile

removed = tempfile.TemporaryDirectory(prefix="pendula-grade-")
work = removed.name
SYMBOLS = """local x, y, u, v, z, w, a, lam, theta, phi = vars "x y u v z w a lam theta phi"
local m, g, l, M, L = param "m", param "g", param "l", param "M", param "L"
"""
TASKS = """
local function record(f, h)
  local list = { y = {}, u = {} }
  for k = 1, 100 do list.y[k], list.u[k] = math.sin(f*k*k), math.cos(h*k^3) end
  return iddata { y = list.y, u = list.u, Ts = 1 }
end
task { "pendulum", answer = dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 } }
task { "positive", answer = dae { der(x) ~ -sqrt(x)*m, 0 ~ y - log(x) } }
task { "period", answer = 2*pi*sqrt(l/g) }
task { "charge", answer = 1.602e-19 }
task { "area", answer = x*y }
task { "motion", answer = der(theta, 2) ~ -g/l*sin(theta) }
task { "poles", answer = { -1, -2 }, any_order = true }
task { "pair", answer = { complex(-1, 1), complex(-1, -1) }, any_order = true }
task { "conditions", answer = { 0 ~ x^2 + y^2 - l^2, 0 ~ x*x.dot + y*y.dot }, any_order = true }
task { "kinetic", answer = m*l^2*theta.dot^2/2, any_names = true }
task { "half", answer = 0.5 }
task { "third", answer = rational(1, 3) }
task { "matrix_a", answer = mat { { 1, 2 }, { 3, 4 } } }
task { "column", answer = vec { 1, 2, 3 } }
task { "zero", answer = 0 }
task { "linear", answer = x + 0 }
task { "circuit", answer = tf({ 1 }, { 1e-12, 1e-6, 1 }) }
task { "plant", fit = record(1, 1), least = 50 }
task { "small", answer = 8.85e-12*x }
task { "growth", answer = exp(x^3) }
"""
MODEL = "dae {{ der(x) ~ u, der(y) ~ v, m*der(u) ~ {0}*x, m*der(v) ~ {0}*y - m*g, 0 ~ {1} }}"
LENGTH = "x^2 + y^2 - l^2"
RIGHT = {
    "pendulum": [
        MODEL.format("z", LENGTH), MODEL.format("lam", LENGTH), MODEL.format("-2*lam", LENGTH),
        MODEL.format("-z/l", "(x^2 + y^2 - l^2)/2"), MODEL.format("-z", "1e6*(x^2 + y^2 - l^2)"),
        MODEL.format("m*z", "1e-9*(l^2 - x^2 - y^2)"), MODEL.format("-z", "sqrt(x^2 + y^2) - l"),
        MODEL.format("-z", LENGTH).replace("m*", "M*").replace("l^2", "L^2"),
        "dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - g, 0 ~ x^2 + y^2 - l^2 }",
        "dae { x^2 + y^2 ~ l^2, v ~ der(y), 7*m*der(v) + 7*lam*y ~ -7*m*g, -der(u) ~ lam*x/m, u ~ der(x) }",
        "dae { der(x) ~ v, der(y) ~ w, m*der(v) ~ -z*x, m*der(w) ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 }",
        "dae { m*der(x, 2) ~ -z*x, m*y.ddot ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 }",
        "lagrange { T = m*(x.dot^2 + y.dot^2)/2, V = m*g*y, q = { x, y }, C = { x^2 + y^2 - l^2 } }",
        "dae { der(x) + der(y) ~ u + v, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 }"],
    "positive": ["dae { der(x) + m*sqrt(x) ~ 0, x ~ exp(y) }"],
    "period": ["2*pi*sqrt(l)/sqrt(g)", "2*math.pi*(l/g)^(1/2)", "2*pi/sqrt(g/l)", "sqrt(4*pi^2*l/g)"],
    "charge": ["1.602e-19", "1.6020000001e-19"],
    "area": ["y*x"],
    "motion": ["l*theta.ddot + g*sin(theta) ~ 0", "m*l^2*theta.ddot ~ -m*g*l*sin(theta)", "theta.ddot/g ~ -sin(theta)/l",
               "0 ~ -5*(l*theta.ddot + g*sin(theta))"],
    "poles": ["tf({ 1 }, { 1, 3, 2 }):poles()", "vec { -2, -1 }", "{ -2.0000001, -1 }", "roots(x^2 + 3*x + 2, x)",
              "eig(mat { { 0, 1 }, { -2, -3 } })"],
    "pair": ["tf({ 1 }, { 1, 2, 2 }):poles()", "{ complex(-1, -1), complex(-1, 1) }"],
    "conditions": ["{ x^2 + y^2 ~ l^2, 2*x*x.dot + 2*y*y.dot ~ 0 }", "{ 0 ~ x*x.dot + y*y.dot, l^2 ~ x^2 + y^2 }"],
    "kinetic": ["M*L^2*phi.dot^2/2", "m*(l*theta.dot)^2/2"],
    "half": ["1/2", "rational(1, 2)", "'1/2'"], "third": ["1/3", "rational(1, 3)", "0.33333333"],
    "matrix_a": ["{ { 1, 2 }, { 3, 4 } }", "mat { { 1, 2 }, { 3, 4.0 } }", "mat { { 1, 2 }, { 3, '4' } }"],
    "column": ["{ 1, 2, 3 }", "mat { { 1 }, { 2 }, { 3 } }"],
    "zero": ["0.0", "1e-17", "sin(pi)", "math.sin(math.pi)"],
    "linear": ["x", "(x^2)/x"],
    "circuit": ["tf({ 1e12 }, { 1, 1e6, 1e12 })", "tf({ 1 }, { 1e-12, 1e-6, 1 }):ss()"],
    "small": ["x*8.85e-12"], "growth": ["exp(x)^(x^2)"],
}
WRONG = {
    "pendulum": [
        "dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ z*y - m*g, 0 ~ x^2 + y^2 - l^2 }",
        "dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ -z*y + m*g, 0 ~ x^2 + y^2 - l^2 }",
        MODEL.format("-z", "x^2 + y^2 - l"), MODEL.format("-z", "x*u + y*v"),
        "dae { der(x) ~ u, der(y) ~ v, der(u) ~ 1e-12*x, 1e-12*der(v) ~ -z*y*1e-12, 0 ~ 1e-12*(x^2 + y^2 - 3*l) }",
        "dae { der(x) ~ u, der(y) ~ v, der(u) ~ 0, der(v) ~ 0, 0 ~ z }",
        "dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, m*der(v) ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 }",
        "dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ -z*y - m*g*ifelse(lt(v, 50), 1, 0), 0 ~ x^2 + y^2 - l^2 }"],
    "positive": ["dae { der(x) ~ -sqrt(x)*m, 0 ~ y - log(x)*1.001 }", "dae { der(x) ~ sqrt(x)*m, 0 ~ y - log(x) }"],
    "period": ["2*pi*sqrt(g/l)", "sqrt(l/g)"], "charge": ["0", "1.5e-19", "-1.602e-19", "0/0", "1e-7"],
    "area": ["abs(x*y)", "abs(x)*abs(y)", "sqrt(x^2*y^2)"],
    "motion": ["l*theta.ddot - g*sin(theta) ~ 0", "theta ~ theta", "0 ~ 0*theta", "1e-12*theta.ddot ~ 1e-12*theta",
               "theta.dot ~ -g/l*sin(theta)", "m*theta.ddot ~ -g/l*sin(theta)"],
    "poles": ["{ -1, -1 }", "{ -1, -2, -3 }", "{ -1 }", "{ 1, 2 }", "{}"],
    "pair": ["{ -1, -1 }", "{ complex(-1, 1), complex(-1, 1) }"],
    "conditions": ["{ x^2 + y^2 ~ l^2, x ~ x }", "{ x^2 + y^2 ~ l^2, x^2 + y^2 ~ l^2 }", "{ x ~ 0, y ~ l }"],
    "kinetic": ["M*L*phi.dot^2/2", "m*l^2*theta.dot^2"],
    "half": ["0.51", "nil", "'x'"], "third": ["0.333"], "matrix_a": ["mat { { 1, 3 }, { 2, 4 } }", "{ { 1, 2 }, { 3, 5 } }"],
    "column": ["{ 1, 2 }", "{ 3, 2, 1 }"], "zero": ["1e-3", "0/0"],
    "linear": ["x + max(x, 100) - 100", "x + abs(x - 50) + x - 50", "x + 1e-5"],
    "circuit": ["tf({ 1 }, { 1e-12, 1e-5, 1 })", "tf({ 1 }, { 5e-12, 1e-6, 1 })", "tf({ 2 }, { 1e-12, 1e-6, 1 })"],
    "plant": ["{ C = { 1e9 } }", "{ A = { 0 } }", "{ D = { 0 } }", "{ F = { 1e300 }, A = { 1e-9 } }", "{ A = { 1, 0/0 } }",
              "{}", "{ A = { 1/0 } }", "{ D = { 1e-9 } }"],
    "small": ["x*5e-12", "0", "1e-12"], "growth": ["exp(x^3) + 0.5", "exp(x^2)"],
}


def write(name, source):
    path = os.path.join(work, name)
    with open(path, "w") as file:
        file.write(source)
    return path


def submissions(answers, prefix):
    """As many scripts as a task has answers; none of them stands in the way of another."""
    for k in range(max(map(len, answers.values()))):
        lines = [f"{task} = {given[k]}" for task, given in answers.items() if k < len(given)]
        yield write(f"{prefix}{k:02}.lua", SYMBOLS + "\n".join(lines) + "\n")


tasks = write("tasks.lua", SYMBOLS + TASKS)
for answers, prefix, accepted in ((RIGHT, "right", ("right", "equivalent")), (WRONG, "wrong", ("wrong",))):
    files = list(submissions(answers, prefix))
    done = subprocess.run([os.environ["PENDULA"], "grade", tasks, *files, "--json"], capture_output=True, text=True,
                          timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    graded = json.loads(done.stdout)["submissions"]
    assert len(graded) == len(files)
    for k, submission in enumerate(graded):
        assert submission["outcome"] == "finished", submission
        verdicts = {answer["task"]: answer for answer in submission["answers"]}
        for task, given in answers.items():
            if k < len(given) and given[k] != "nil":
                assert verdicts[task]["verdict"] in accepted, (task, given[k], verdicts[task])
print(sum(map(len, RIGHT.values())), "right answers and", sum(map(len, WRONG.values())), "wrong ones")
