"""pendula report: pages are read with Python's parser of HTML. What must be there: the text, the code, values as
mathematics, figures, errors in their places; what must not: markup that a script printed, anything to fetch."""
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from html.parser import HTMLParser

PROGRAM = os.environ.get("PENDULA", "build/release/pendula")
ROOT = os.environ.get("PENDULA_ROOT", ".")
VOID = {"meta", "br", "hr", "img", "link", "input", "col", "use", "path", "rect", "circle", "stop"}


class Page(HTMLParser):
    """Checks that elements close in order; keeps elements, texts per element, and attributes."""

    def __init__(self, html):
        super().__init__(convert_charrefs=True)
        self.html, self.open, self.elements, self.words = html, [], [], []
        self.feed(html)
        self.close()
        assert not self.open, "never closed: %s" % self.open

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        assert self.open and self.open[-1] == tag, "</%s> closes <%s>" % (tag, self.open[-1:])
        self.open.pop()

    def handle_data(self, data):
        if "style" not in self.open and "script" not in self.open:
            self.words.append((tuple(self.open), data))

    def count(self, tag):
        return sum(1 for name, _ in self.elements if name == tag)

    def text(self, within=None):
        return "".join(data for path, data in self.words if within is None or within in path)


class ReportTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()

    def report(self, source, *arguments, status=0, suffix=".html", name="exam.lua"):
        script = os.path.join(self.folder, name)
        with open(script, "wb") as file:
            file.write(source if isinstance(source, bytes) else source.encode())
        target = os.path.join(self.folder, "page" + suffix)
        run = subprocess.run([PROGRAM, "report", script, "-o", target, *arguments], capture_output=True,
                             text=True, cwd=self.folder, timeout=100)
        self.assertEqual(run.returncode, status, run.stderr)
        self.assertEqual(run.stdout, "", "what a script prints belongs to its page")
        self.said = run.stderr
        with open(target, "rb") as file:
            self.bytes = file.read()
        return Page(self.bytes.decode()) if suffix == ".html" else None

    def test_reports_are_mathematics(self):
        page = self.report("""x = var("x", 3)
p = dae{ mat{{1, 1, 0}, {0, 0, 1}, {1, 1, 1}}*der(x) ~ x }
print(p:pencil())
print(p:structure())
print(tf({1}, {1, 2, 5}):poles())
print(p:constraints())
q = var("q", 2)
print(lagrange{ q = q, T = q.dot.T*q.dot, V = q[2], C = { (q.T*q - 1)/2 } }:constraints())
""")
        self.assertGreaterEqual(page.count("math"), 10)
        for expected in ("finite modes", "index 2", "poles:", "(1c) - (1a) - (1b):", "from (2)",
                         "(2) differentiated"):
            self.assertIn(expected, page.text("main"))
        for markup in ("noindent", "hspace", "quad", "\\\\"):
            self.assertNotIn(markup, page.text("main"))

    def test_text_code_mathematics_and_figure(self):
        page = self.report('--- # Length of a **rod**\n--- where $a^2 = b_1$\nx = var "x"  -- the place\n'
                           'print(x^2/3)\nplot({1, 4, 9}, { title = "Squares" }):show()\n')
        self.assertIn("Length of a rod", page.text("h1"))
        self.assertIn("title", [name for name, _ in page.elements])
        self.assertIn('x = var "x"  -- the place', page.text("code"))
        self.assertEqual(page.count("math"), 2)
        self.assertEqual(page.count("mfrac"), 1)
        self.assertEqual(page.count("svg"), 1)
        self.assertIn("Squares", page.text("svg"))
        self.assertIn("Latin Modern Math Subset", page.html)

    def test_nothing_is_fetched(self):
        page = self.report('plot({1, 2}):show() print(var "x")')
        for tag, attributes in page.elements:
            for key in ("src", "data", "action", "poster"):
                self.assertNotIn(key, attributes, tag)
            if tag != "a" and "href" in attributes:
                self.assertTrue(attributes["href"].startswith("#"), attributes)
        for target in re.findall(r"url\(([^)]*)\)", page.html):
            self.assertTrue(target.startswith(("data:", "#")), target[:40])
        self.assertNotIn("@import", page.html)
        self.assertNotIn("http://", page.html.replace("http://www.w3.org/", ""))

    def test_names_are_unique_on_a_page(self):
        page = self.report('for i = 1, 3 do plot({1, i, 2}, { marker = "ring", style = "points" }):show() end')
        names = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
        self.assertEqual(len(names), len(set(names)))
        for _, attributes in page.elements:
            if attributes.get("href", "").startswith("#"):
                self.assertIn(attributes["href"][1:], names)

    def test_hostile_text(self):
        hostile = (b'--- # <script>alert(1)</script> [a](javascript:alert(2)) $\\begin{x}}{{\\frac$\n'
                   b'--- <img src=x onerror=alert(3)> \x00\xff\xfe\n'
                   b'print "<script>alert(4)</script> &amp; \\\\ \\xff\\xc0 \\0 \\27[31m"\n'
                   b'print(var "x<b>", "</div>")\n'
                   b'plot({1, 2}, { title = "</svg><script>alert(5)</script>", labels = { "<&>" } }):show()\n'
                   b'error "<script>alert(6)</script>"\n')
        page = self.report(hostile, status=1)
        self.assertEqual(page.count("script"), 1)        # ours
        self.assertEqual(page.count("img"), 0)
        self.assertNotIn("x<b>", page.html)
        for tag, attributes in page.elements:
            self.assertFalse(attributes.get("href", "").strip().lower().startswith("javascript"))
            self.assertFalse([key for key in attributes if key.startswith("on")], tag)
        self.assertIn("<script>alert(4)</script> &amp; \\ \ufffd", page.text("pre"))
        self.assertIn("alert(6)", page.text("pre"))
        self.assertNotIn("\x00", page.html)
        self.assertNotIn("\x1b", page.html)

    def test_error_stands_where_it_happened(self):
        page = self.report('print "before"\nlocal a = 1\nprint(a + nothing)\nprint "never"\n', status=1)
        self.assertIn("exam.lua:3:", self.said)
        order = [page.html.index(words) for words in ("before", "exam.lua:3:", "not run")]
        self.assertEqual(order, sorted(order))
        self.assertIn('role="alert"', page.html)

    def test_syntax_error(self):
        page = self.report("x = = 1\n", status=1)
        self.assertIn("unexpected symbol", page.text("pre"))

    def test_the_program_is_the_same(self):
        """Marks between statements change neither locals, nor lines, nor what belongs together."""
        source = ('#!/usr/bin/env pendula\nlocal a <const>, b = 1, 2\nlocal f\n= print\n;(f or g)(a, b)\n'
                  'local function h() return debug.getinfo(2, "l").currentline end\ngoto on\n::on::\n'
                  'for i = 1, 2 do f(i) end while false do end repeat until true\nlocal s = f\n"x" f(s == nil)\n'
                  'f(h())\ndo local k = { [1] = function() return 7 end } f(k[1]()) end\nf(...)\nf(arg[0], arg[1])\n'
                  'return 5\n')
        page = self.report(source, "--", "one", "two")
        printed = "".join(page.text("pre").split("\n"))
        lines = [line for line in page.text("section").split("\n") if line]
        script = os.path.join(self.folder, "exam.lua")
        plain = subprocess.run([PROGRAM, script, "one", "two"], capture_output=True, text=True).stdout
        self.assertEqual(lines, [line for line in plain.split("\n") if line], printed)

    def test_everything_written_is_caught_in_order(self):
        page = self.report('io.write("a\\n")\nprint "b" io.stdout:write("c\\n") os.execute "echo d" '
                           'io.stderr:write("e\\n") print "f"\nos.exit(3)\nprint "g"', status=3)
        self.assertEqual(" ".join(data for path, data in page.words if "section" in path).split(),
                         list("abcdef"))

    def test_fold_and_timing(self):
        page = self.report('for i = 1, 500 do print(i) end', "--fold", "--timing")
        self.assertIn("485 more lines", page.text("summary"))
        closed = [a for tag, a in page.elements if tag == "details"]
        self.assertFalse([a for a in closed if "open" in a])
        plain = self.report('print(1)').html
        self.assertEqual(plain, self.report('print(1)').html)      # no dates, no times
        self.assertNotIn('class="timing"', plain)

    def test_values_as_tables_and_formulas(self):
        page = self.report('x, y = vars "x y"\nsys = dae { der(x) ~ y, der(y) ~ -x }\nprint(sys)\n'
                           'print(rk.gauss(2))\nprint(evaluate(mat{{1, 2.5e-12}, {3, 4}}))\n'
                           'print(tf({1}, {1, 2, 1}):ss())\nprint(jacobian({x*y}, {x, y}), "and", 3)\nprint(x ~ y)\n'
                           'u, v, z = vars "u v z"\nball = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, '
                           'der(v) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }:reduce "ggl"\n'
                           'at = ball:init { fix = { [x] = 1, [v] = 0 }, guess = { y = 0 } }\n'
                           'print(ball:integrate { start = at, to = 1, method = "radau" }:drift())')
        self.assertIn("(1)", page.text("mtext"))
        self.assertGreaterEqual(page.count("mtable"), 5)
        self.assertIn("2.5e-12", page.text("td"))
        self.assertIn("and", page.text("span"))
        self.assertGreaterEqual(page.count("table"), 3)

    def test_line_ends_of_other_systems(self):
        page = self.report('--- # Title\r\n--- text\r\nx = 1\r\nprint(x)\r\n')
        self.assertEqual(page.text("h1"), "Title")
        self.assertNotIn("\ufffd", page.html)

    def test_without_gnuplot(self):
        script = os.path.join(self.folder, "exam.lua")
        with open(script, "w") as file:
            file.write('plot({1, 2}, { title = "Line" }):show()')
        run = subprocess.run([os.path.abspath(PROGRAM), "report", script, "-o", "x.html"], capture_output=True,
                             text=True, cwd=self.folder, env={"PATH": self.folder})
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(os.path.join(self.folder, "x.html")) as file:
            page = Page(file.read())
        self.assertIn("apt-get install gnuplot-nox", page.text("figcaption"))
        self.assertIn("Line", page.text("pre"))

    def test_interrupt(self):
        script = os.path.join(self.folder, "exam.lua")
        with open(script, "w") as file:
            file.write('print "before"\nwhile true do end')
        run = subprocess.Popen([PROGRAM, "report", script, "-o", script + ".html"], stderr=subprocess.PIPE)
        time.sleep(1.5)
        run.send_signal(signal.SIGINT)
        run.communicate(timeout=60)
        self.assertEqual(run.returncode, 130)
        with open(script + ".html") as file:
            page = Page(file.read())
        self.assertIn("before", page.text("pre"))
        self.assertIn("interrupted", page.text("pre"))

    def test_animation(self):
        page = self.report('th = var "theta"\nsol = dae { der(th, 2) ~ -9.81*sin(th) }:integrate { '
                           'start = { [th] = 1, [th.dot] = 0 }, to = 2 }\n'
                           'film = animate(sol, { vec(sin(th), -cos(th)) })\nfilm:show()\nview { film, plot{1, 2} }')
        self.assertEqual(page.count("svg"), 3)
        self.assertGreater(page.count("animate"), 1)

    def test_slider(self):
        page = self.report('view({ plot({1, 2}), plot({2, 1}) }, { slider = "k", values = { 1, 2 } })')
        self.assertEqual(page.count("svg"), 2)             # both are there without a script
        self.assertIn("k = 2", page.text("p"))
        for wrong, words in (('view({ 1 }, { slider = "k" })', "not a figure"),
                             ('view({ plot{1, 2} }, { slider = "k", values = { 1, 2 } })', "1 figures need"),
                             ('view(plot{1, 2}, { slider = "k" })', "list of figures"),
                             ('view(1, { fil = "x" })', "Did you mean 'file'"), ("view(nil)", "nothing to show")):
            self.report(wrong, status=1)
            self.assertIn(words, self.said)

    def test_usage(self):
        for arguments, status, words in (([], 1, "which script"), (["--timng", "x.lua"], 1, "--timing"),
                                         (["missing.lua"], 1, "No such file"), (["--help"], 0, "usage")):
            run = subprocess.run([PROGRAM, "report", *arguments], capture_output=True, text=True, cwd=self.folder)
            self.assertEqual(run.returncode, status, arguments)
            self.assertIn(words, run.stdout + run.stderr)
        script = os.path.join(self.folder, "exam.lua")
        with open(script, "w") as file:
            file.write("print(1)")
        run = subprocess.run([PROGRAM, "report", script, "-o", "page.docx"], capture_output=True, text=True,
                             cwd=self.folder)
        self.assertEqual(run.returncode, 1)
        self.assertIn(".html or .pdf", run.stderr)
        run = subprocess.run([PROGRAM, "report", script], capture_output=True, text=True, cwd=self.folder)
        self.assertTrue(os.path.exists(os.path.join(self.folder, "exam.html")), run.stderr)

    def test_pdf_without_chromium_names_the_package(self):
        script = os.path.join(self.folder, "exam.lua")
        with open(script, "w") as file:
            file.write("print(1)")
        os.mkdir(os.path.join(self.folder, "bin"))
        os.symlink("/bin/sh", os.path.join(self.folder, "bin", "sh"))
        run = subprocess.run([os.path.abspath(PROGRAM), "report", script, "-o", "x.pdf"], capture_output=True,
                             text=True, cwd=self.folder, env={"PATH": os.path.join(self.folder, "bin")})
        self.assertEqual(run.returncode, 1)
        self.assertIn("apt-get install chromium", run.stderr)

    def test_large(self):
        """10⁴ lines and 40 figures: seconds, a few megabytes."""
        source = 'x = var "x"\n' + "".join("a%d = x + %d\n" % (i % 50, i) for i in range(9960)) + \
            "".join("plot({1, %d, 2}):show()\n" % i for i in range(40))
        begin = time.time()
        page = self.report(source)
        self.assertLess(time.time() - begin, 30)
        self.assertEqual(page.count("svg"), 40)
        self.assertLess(len(self.bytes), 5000000)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"] if "-v" in sys.argv else None)
