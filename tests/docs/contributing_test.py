# CONTRIBUTING.md is true: each addition of its table is made in a scratch copy of the sources, in as many files as
# the table says, and works. Without arguments (CTest): a program is linked from the present build with the additions
# that change no type that other files see, and the files that an operation concerns are compiled. With --all
# (./dev contribute): the scratch copy is configured and built whole.
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = os.environ.get("PENDULA_ROOT") or os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
PROGRAM = os.environ.get("PENDULA") or os.path.join(ROOT, "build/release/pendula")
BUILD = os.path.dirname(os.path.abspath(PROGRAM))

# Per addition: what changes (file -> text of a new file, or (anchor, text to put behind it)), then Lua statements
# whose printed results show that it is there.
ADDITIONS = {
    "a tableau": ({
        "stdlib/tableaus/explicit/docs_midpoint.lua": """return {
  name = "docs_midpoint", order = 2, text = "The midpoint rule once more.", cite = "Runge, Math. Annalen 46, 1895",
  c = { 0, "1/2" }, A = { {}, { "1/2" } }, b = { 0, 1 },
}
""",
        "stdlib/tableaus/init.lua": ('"euler", ', '"docs_midpoint", '),
    }, [("rk.docs_midpoint:order()", "2")]),
    "a reference problem": ({
        "stdlib/problems/linear/docs_decay.lua": """return {
  title = "Decay", source = "by hand", statement = "An ODE.", tags = "linear", index = 0, dof = 1,
  structural_index = 0, structural_dof = 1, verdict = "valid", to = 1, dt = 0.1,
  build = function()
    local x = var "x"
    return { model = dae { der(x) ~ -x }, constraints = {}, fix = { [x] = 1 }, exact = { [x] = exp(-t) } }
  end,
}
""",
        "stdlib/problems/init.lua": ('"reissig", ', '"docs_decay", '),
    }, [("problems.docs_decay.title", "Decay")]),
    "a function in Lua": ({
        "stdlib/lti.lua": (None, """
doc { name = "docs_twice", module = "lti", sig = "docs_twice(x) -> number", text = "2 x.",
  example = "docs_twice(2)", gives = "4", function(x) return 2 * x end }
"""),
    }, [("docs_twice(2)", "4")]),
    "a function in C++": ({
        "src/lua/bind/lti/lti_analysis.cpp": [
            (r"\nnamespace {\n", """
int docs_settling(Call& call) { return call.push(4 / (call.number(1, "wn") * call.number(2, "zeta"))); }
"""),
            (r'        {"margin", ', None, '        {"docs_settling", docs_settling, "docs_settling(wn, zeta) -> seconds", '
             '"2 % settling time.",\n         "docs_settling(2, 0.5)", "4.0"},\n'),
        ],
    }, [("docs_settling(2, 0.5)", "4.0")]),
    "a reduction form": ({
        "src/dae/reduce/reduce_docs.cpp": """#include "dae/reduce/reduced_forms.hpp"
namespace pendula::dae {
ModelPtr reduce_docs(const ModelPtr& model) { return reduce_acc(model); }
}  // namespace pendula::dae
""",
        "src/dae/reduce/reduced_forms.hpp": (r"namespace pendula::dae {\n",
                                             "\nModelPtr reduce_docs(const ModelPtr& model);\n"),
        "src/dae/reduce/reduce_choice.cpp": (r"const Form forms\[\] = {\n", """\
    {"docs", [](const ModelPtr& m, const ReduceOptions&) { return reduce_docs(m); }},
"""),
    }, [("problems.pendulum.model:reduce('docs'):index()", "1")]),
    "a model class": ({
        "src/lua/bind/sysid/sysid_models.cpp": [
            (r"\nint pem\(Call& call\) {", None, """
const OptionTable docs_options = {{"na", "number", "1", "order of A"},
                                  {"nb", "number", "1", "order of B"},
                                  {"nd", "number", "1", "order of D"},
                                  {"nk", "number", "1", "delay"}};
int docs_ararx(Call& call) {
  check_estimation(call);
  return estimate_pem(call, call.options(2), "ARARX");
}
"""),
            (r'\n        {"bj", ', None, """
        {"docs_ararx", docs_ararx, "docs_ararx(d, { na =, nb =, nd =, nk = 1 }) -> idmodel", "A y = B u + e/D.", "", "", &docs_options},"""),
        ],
    }, [("#docs_ararx(iddata.read('ROOT/scripts/data/hairdryer.csv', { y = 'y_temp', u = 'u_voltage', Ts = 0.08 })"
         ":detrend(), { na = 1, nb = 1, nd = 1, nk = 3 }).theta", "3")]),
    "a method family": ({
        "src/integrate/step/docs_stepper.hpp": """// The explicit Euler method with steps of one length.
#pragma once
#include "integrate/problem/rhs_solver.hpp"
#include "integrate/step/stepper.hpp"
namespace pendula::integrate {
class DocsStepper final : public Stepper {
 public:
  DocsStepper(const ProblemPtr& problem, const Tolerances& tolerances, Stats& stats)
      : Stepper(problem, tolerances, {}, stats), rhs_(problem, stats) {}
  std::string name() const override { return "docs_euler"; }
  void start(const Point& point, double) override {
    here_ = before_ = point;
    rhs_.require(here_.t, here_.x.data(), here_.xdot.data(), here_.z.data());
  }
  void step(double end) override {
    before_ = here_;
    const double dt = fitted(1e-3, end);
    here_.t = std::fabs(end - here_.t) <= std::fabs(dt) ? end : here_.t + dt;
    here_.x += dt * before_.xdot;
    rhs_.require(here_.t, here_.x.data(), here_.xdot.data(), here_.z.data());
  }
  Detail look(const StepView& step, double t, Detail detail, Point& out) override {
    out = step.from;
    out.t = t;
    out.x += (t - step.from.t) * step.from.xdot;
    return detail;
  }

 private:
  RhsSolver rhs_;
};
}  // namespace pendula::integrate
""",
        "src/integrate/run/methods.cpp": [
            (r'#include "method/collocation.hpp"\n', '#include "integrate/step/docs_stepper.hpp"\n'),
            (r"\n}  // namespace family", None, """
const MethodFamily docs{.name = "docs_euler",
                        .alias = {},
                        .text = "explicit Euler",
                        .listed = true,
                        .is_explicit = true,
                        .one_step = false,
                        .instead = "rk.euler",
                        .default_method = "",
                        .make = [](const StepperRequest& q) -> std::shared_ptr<Stepper> {
                          return std::make_shared<DocsStepper>(q.problem, q.tolerances, q.stats);
                        },
                        .objection_to_index_2 = none};
"""),
            (r"all\[\] = \{", "&family::docs, "),
        ],
    }, [("dae{ der(var 'x') ~ -var 'x' }:integrate{ start = { x = 1 }, to = 0.1, method = 'docs_euler' }.status",
         "finished")]),
    "an operation": ({
        "src/expr/ops.def": (r"OP\(sin, [^\n]*\n", """\
OP(cbrt, 1, named, odd, at(0, 0), each, std::cbrt(a), one / (Expr(3) * r * r), zero, zero, .5, 3, "\\\\sqrt[3]", "cube root")
"""),
    }, [("cbrt(8.0)", "2.0"), ("diff(cbrt(var 'x'), var 'x')", "1/(3 cbrt²(x))"), ("simplify(cbrt(-var 'x'))", "-cbrt(x)")]),
}
OPERATION_FILES = ["src/expr/graph/graph.cpp", "src/codegen/tape/tape.cpp", "src/codegen/machine/functions.cpp",
                   "src/codegen/machine/lane_functions_avx2.cpp", "src/lua/bind/expr/expr_functions.cpp"]


def fail(message):
    sys.exit(f"contributing_test.py: {message}")


def copy_tree(scratch):
    for folder in ("src", "stdlib", "cmake", "docs", "tests", "bench"):
        shutil.copytree(os.path.join(ROOT, folder), os.path.join(scratch, folder))
    for name in ("CMakeLists.txt", "CMakePresets.json"):
        shutil.copy(os.path.join(ROOT, name), scratch)


def insert(text, file, anchor, behind, *more):
    """(anchor, text): behind the anchor; (anchor, None, text): before it; further pairs follow."""
    if anchor is None:
        return text + behind
    found = re.search(anchor, text)
    if not found:
        fail(f"{file}: CONTRIBUTING.md's addition finds no place (anchor {anchor!r})")
    if behind is None:
        at, behind, more = found.start(), more[0], more[1:]
    else:
        at = found.end()
    text = text[:at] + behind + text[at:]
    return insert(text, file, *more) if more else text


def add(scratch, files):
    for file, change in files.items():
        path = os.path.join(scratch, file)
        if isinstance(change, str):
            assert not os.path.exists(path), path
            text = change
        else:
            with open(path, encoding="utf-8") as source:
                text = source.read()
            for one in change if isinstance(change, list) else [change]:
                text = insert(text, file, *one)
        with open(path, "w", encoding="utf-8") as target:
            target.write(text)


def check_counts():
    with open(os.path.join(ROOT, "CONTRIBUTING.md"), encoding="utf-8") as page:
        said = dict(re.findall(r"^\| (an? [^|]*?) \| (\d+) \|", page.read(), re.M))
    for name, (files, _) in ADDITIONS.items():
        if said.pop(name, None) != str(len(files)):
            fail(f"CONTRIBUTING.md counts the places of '{name}' wrongly: they are {len(files)}")
    if said:
        fail(f"CONTRIBUTING.md counts places of what is not tested: {', '.join(said)}")


def run(command, **options):
    result = subprocess.run(command, shell=isinstance(command, str), cwd=BUILD, text=True, capture_output=True,
                            **options)
    if result.returncode:
        fail(f"{command}\n{result.stdout[-3000:]}{result.stderr[-3000:]}")
    return result.stdout


def compile_commands():
    with open(os.path.join(BUILD, "compile_commands.json"), encoding="utf-8") as file:
        return {os.path.relpath(entry["file"], ROOT): entry for entry in json.load(file)}


def compiled_together(commands, file):
    """The command of files that are compiled as one (pendula_unity in CMakeLists.txt), among them one of file's folder."""
    folder = f'#include "{os.path.join(ROOT, os.path.dirname(file))}/'
    for path, entry in commands.items():
        if "/Unity/" in path:
            with open(entry["file"], encoding="utf-8") as together:
                if folder in together.read():
                    return entry
    fail(f"{file} is compiled by no command")


def compile_in(scratch, commands, file, like=None, target=None):
    """Compiles a file of the scratch copy as the build compiles `like`; without a target only its syntax is read."""
    entry = commands.get(like or file) or compiled_together(commands, like or file)
    words = shlex.split(entry["command"])
    original = entry["file"]
    words = [word.replace(ROOT + "/src", scratch + "/src") for word in words]
    words = [os.path.join(scratch, file) if word in (original, original.replace(ROOT + "/src", scratch + "/src"))
             else word for word in words]
    # A header precompiled by clang holds headers of the tree itself, which are not those of the scratch copy.
    words = shlex.split(re.sub(r"-Xclang -include(-pch)? -Xclang \S+ ?", "", shlex.join(words)))
    words[words.index("-o") + 1] = target or "/dev/null"
    # Precompiled headers keep their level; where only the syntax is read nothing is optimised.
    quick = ["-O0"] if target and "-include-pch" not in words else []
    run(words + quick + ([] if target else ["-fsyntax-only"]))


def check_results(program, additions):
    for name in additions:
        for statement, expected in ADDITIONS[name][1]:
            printed = run([program, "-e", f"print({statement.replace('ROOT', ROOT)})"]).strip()
            if printed != expected:
                fail(f"{name}: {statement} prints {printed!r}, not {expected!r}")


def quick(scratch):
    """The additions that only new or changed source files see, linked with the libraries of the build."""
    commands = compile_commands()
    names = [name for name in ADDITIONS if name != "an operation"]
    objects = []
    for name in names:
        add(scratch, ADDITIONS[name][0])
    if "src/dae/reduce/reduce_choice.cpp" not in commands:
        # Files are compiled together: one of them cannot be exchanged in a library, but it can be read.
        for name in names:
            for file in ADDITIONS[name][0]:
                if file.endswith(".cpp"):
                    compile_in(scratch, commands, file)
        print("syntax only, as files are compiled together (PENDULA_UNITY); ./dev contribute builds and runs it all")
        return
    for name in names:
        for file in ADDITIONS[name][0]:
            if file.endswith(".cpp"):
                objects.append(os.path.join(scratch, os.path.basename(file) + ".o"))
                like = file if file in commands else "src/dae/reduce/reduce_choice.cpp"
                compile_in(scratch, commands, file, like, objects[-1])
    embedded = os.path.join(scratch, "embedded_stdlib.cpp")
    library = sorted(os.path.join(folder, name) for folder, _, files in os.walk(os.path.join(scratch, "stdlib"))
                     for name in files if name.endswith(".lua"))
    run([os.path.join(BUILD, "tools/pendula_embed"), embedded, os.path.join(scratch, "stdlib"), *library])
    objects.append(embedded + ".o")
    compile_in(scratch, commands, "embedded_stdlib.cpp",
               os.path.relpath(os.path.join(BUILD, "embedded_stdlib.cpp"), ROOT), objects[-1])
    link = run(["ninja", "-t", "commands", "pendula"]).strip().splitlines()[-1]
    program = os.path.join(scratch, "pendula")
    run(re.sub(r" -o pendula ", f" -o {program} {' '.join(objects)} ", link))
    check_results(program, names)

    add(scratch, ADDITIONS["an operation"][0])
    for file in OPERATION_FILES:
        compile_in(scratch, commands, file)


def whole(scratch):
    for files, _ in ADDITIONS.values():
        add(scratch, files)
    build = os.path.join(scratch, "build")
    run(["cmake", "-S", scratch, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug", "-DPENDULA_TESTS=OFF",
         "-DCMAKE_CXX_FLAGS_DEBUG=-O1"])
    run(["cmake", "--build", build, "--target", "pendula"])
    check_results(os.path.join(build, "pendula"), ADDITIONS)


check_counts()
if "--all" not in sys.argv and not os.path.exists(os.path.join(BUILD, "build.ninja")):
    print("skipped: the build directory is not ninja's: " + BUILD)
    sys.exit()
with tempfile.TemporaryDirectory(prefix="pendula_contributing_") as folder:
    copy_tree(folder)
    (whole if "--all" in sys.argv else quick)(folder)
print("CONTRIBUTING.md is true")
