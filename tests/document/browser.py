"""Documents in chromium (./dev test-browser): mathematics has a size and its font, figures are drawn, nothing is
fetched, nothing complains, text can be selected, pages print, light and dark can be read. Pictures are left in the
folder that is the first argument."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import chromium  # noqa: E402

PROGRAM = os.environ.get("PENDULA", "build/release/pendula")
ROOT = os.environ.get("PENDULA_ROOT", ".")
FOLDER = None
AXE = os.environ.get("PENDULA_AXE", "")                # axe.min.js, for the accessibility check

SCRIPT = r'''
--- # The pendulum
--- The length is kept: $\sqrt{x^2 + y^2} = L$.
x, y, u, v, z = vars "x y u v z"
pend = dae { der(x) ~ u, der(y) ~ v, der(u) ~ -z*x, der(v) ~ -z*y - 9.81, 0 ~ x^2 + y^2 - 1 }
print(pend)
print(jacobian({ x^2/y, sin(x) }, { x, y }))
low = pend:reduce "ggl"
at = low:init { fix = { [x] = 1, [v] = 0 }, guess = { y = 0 } }
print(at:ledger())
sol = low:integrate { start = at, to = 5, method = "radau" }
print(sol:drift())
plot(sol, { x, y }, { title = "Place" }):show()
plot3(sol, vec{x, y, t}, { title = "In space" }):show()
for i = 1, 100 do print("line " .. i) end
view({ plot({1, 2, 3}), plot({3, 2, 1}), plot({2, 2, 2}) }, { slider = "k", values = { 0.5, 1, 2 } })
semilogy({ 1, 2, 3 }, { 1, 100, 10000 }):show()
print(rk.gauss(3))
error "here"
'''


def visible(browser, selector):
    return browser.value("""Array.from(document.querySelectorAll(%r)).map(e => {
        const box = e.getBoundingClientRect(); return [box.width, box.height] })""" % selector)


class BrowserTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = chromium.Browser()
        cls.page = os.path.join(FOLDER, "report.html")
        script = os.path.join(FOLDER, "exam.lua")
        with open(script, "w") as file:
            file.write(SCRIPT)
        subprocess.run([PROGRAM, "report", script, "-o", cls.page, "--timing"], stderr=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def accessible(self, name):
        if not AXE:
            return
        with open(AXE) as file:
            self.browser.value(file.read() + "; 0")
        found = self.browser.value("axe.run({preload: false}).then(r => r.violations.map(v => v.id + ': ' + v.nodes.length + ' ' + "
                                   "v.nodes[0].html.slice(0, 200)))")
        self.assertEqual(found, [], name)

    def test_report(self):
        browser = self.browser
        browser.media()
        browser.size(900, 1200)
        browser.open(self.page)
        browser.picture(os.path.join(FOLDER, "report.png"))
        self.assertEqual(browser.complaints(), [])
        formulas, figures = visible(browser, "math"), visible(browser, "figure svg")
        self.assertGreaterEqual(len(formulas), 4)
        self.assertTrue(all(w > 5 and h > 8 for w, h in formulas), formulas)
        self.assertEqual(len(figures), 6)
        self.assertEqual(len([f for f in figures if f[0] == 0]), 2, "frames behind the slider")
        self.assertTrue(all(w > 300 and h > 200 for w, h in figures if w), figures)
        self.assertTrue(browser.value("document.fonts.check('12px \"Latin Modern Math Subset\"')"))
        self.assertTrue(browser.value("Array.from(document.fonts).every(f => f.status == 'loaded')"))
        self.assertGreater(browser.value("document.querySelectorAll('figure svg path').length"), 4)
        self.assertIn("consistent start", browser.value(
            "(() => { getSelection().selectAllChildren(document.querySelector('main')); "
            "return getSelection().toString() })()"))
        overflow = browser.value("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        self.assertLessEqual(overflow, 0)
        self.accessible("light")

    def test_manual(self):
        folder = os.path.join(FOLDER, "manual")
        subprocess.run([PROGRAM, "manual", "-o", folder], check=True)
        browser = self.browser
        browser.media()
        browser.size(1000, 900)
        for name in ("index", "tutorial", "concepts", "control", "identification", "cookbook", "gallery", "coming-from",
                     "language", "reference", "glossary", "derivations", "ref-dae", "ref-lti-responses"):
            browser.open(os.path.join(folder, name + ".html"))
            self.assertEqual(browser.complaints(), [], name)
            self.assertTrue(all(w > 3 and h > 8 for w, h in visible(browser, "math:not(.output *, td *)")), name)
            self.assertTrue(all(w > 3 and h > 5 for w, h in visible(browser, "math")), name)     # a lone x is flat
            overflow = browser.value("document.documentElement.scrollWidth - document.documentElement.clientWidth")
            self.assertLessEqual(overflow, 0, name)
            browser.picture(os.path.join(FOLDER, "manual-" + name + ".png"))
            self.accessible(name)
        for words, first in (("reduce", "model:reduce"), ("stiff", "stiffness"), ("initial values", "consistent start"),
                             ("bode", "bode"), ("export", "exporting"), ("latex", "latex"), ("event", "events"),
                             ("units", "units and labels"), ("steady state", "steady state"), ("pid", "controllers"),
                             ("optimization", "optimisation"), ("eigenvalues", "eig"), ("plot", "plot"),
                             ("nonlinear equations", "solving equations"), ("lqr", "lqr"), ("matrix", "vectors and matrices"),
                             ("transfer function", "transfer function"), ("monte carlo", "parameter sweeps"),
                             ("how do I fit parameters", "fit"), ("simulink", "other programs"),
                             ("differential equation", "model"), ("friction", "networks and mechanisms")):
            found = browser.value("""(() => { const input = document.getElementById('words'); input.value = %r;
                input.dispatchEvent(new Event('input'));
                return Array.from(document.querySelectorAll('#found a')).slice(0, 3).map(a => a.textContent) })()""" % words)
            self.assertIn(first, found, words)
            if words not in ("simulink", "friction"):
                self.assertEqual(found[0], first)

    def test_notebook(self):
        kernel = os.path.join(os.path.dirname(os.path.abspath(PROGRAM)), "pendula-kernel")
        try:
            import nbconvert
            import nbformat
            from nbclient import NotebookClient
        except ImportError:
            self.skipTest("python3-nbclient and python3-nbconvert are not here")
        if not os.path.exists(kernel):
            self.skipTest("no pendula-kernel beside the program")
        subprocess.run([PROGRAM, "kernel", "install", "--prefix", FOLDER], check=True, stdout=subprocess.DEVNULL)
        os.environ["JUPYTER_PATH"] = os.path.join(FOLDER, "share", "jupyter")
        cells = ["plot({1, 4, 9})", 'dae { der(var "x") ~ -var "x" }', 'plot({1, 2}):show() plot({2, 1}):show()']
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
        NotebookClient(notebook, kernel_name="pendula", timeout=60).execute()
        page, _ = nbconvert.HTMLExporter(template_name="basic").from_notebook_node(notebook)
        target = os.path.join(FOLDER, "notebook.html")
        with open(target, "w") as file:
            file.write('<!DOCTYPE html><meta charset="utf-8"><title>n</title>' + page)
        self.browser.media()
        self.browser.size(900, 1200)
        self.browser.open(target)
        widths = self.browser.value("Array.from(document.images).map(i => i.naturalWidth)")
        self.assertEqual(len(widths), 3)
        self.assertTrue(all(width > 300 for width in widths), widths)
        self.assertTrue(all(w > 20 and h > 10 for w, h in visible(self.browser, "math")))
        self.browser.picture(os.path.join(FOLDER, "notebook.png"))

    def test_a_fraction_is_two_lines_high(self):
        self.browser.open(self.page)
        whole, part = self.browser.value("""(() => { const f = document.querySelector('mfrac').getBoundingClientRect(),
            n = document.querySelector('mfrac > *').getBoundingClientRect(); return [f.height, n.height] })()""")
        self.assertGreater(whole, 1.6 * part)

    def test_narrow(self):
        self.browser.size(360, 700)
        self.browser.open(self.page)
        overflow = self.browser.value("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        self.assertLessEqual(overflow, 0)
        self.browser.picture(os.path.join(FOLDER, "narrow.png"))

    def test_dark(self):
        self.browser.size(900, 1200)
        self.browser.media(dark=True)
        self.browser.open(self.page)
        ink, paper = self.browser.value("[getComputedStyle(document.body).color, "
                                        "getComputedStyle(document.body).backgroundColor]")
        light = [sum(map(int, re.findall(r"\d+", colour)[:3])) for colour in (ink, paper)]
        self.assertGreater(light[0], light[1] + 400)
        self.browser.picture(os.path.join(FOLDER, "dark.png"))
        self.accessible("dark")
        self.browser.media()

    def test_click_enlarges(self):
        self.browser.size(1400, 1000)
        self.browser.open(self.page)
        before, _ = visible(self.browser, "figure svg")[0]
        self.browser.value("document.querySelector('figure svg').dispatchEvent(new MouseEvent('click'))")
        self.assertGreater(visible(self.browser, "figure.large svg")[0][0], before * 1.2)

    def read(self, number, fx, fy):
        """What the pointer reads at a place in figure `number`, as fractions of its size."""
        return self.browser.value("""(() => { const svg = document.querySelectorAll('figure svg')[%d],
            box = svg.getBoundingClientRect();
            svg.dispatchEvent(new PointerEvent('pointermove', { clientX: box.left + %g*box.width,
                clientY: box.top + %g*box.height }));
            const reading = svg.parentNode.querySelector('.reading');
            return reading ? reading.textContent : null })()""" % (number, fx, fy))

    def test_the_pointer_reads_values(self):
        self.browser.size(900, 1200)
        self.browser.open(self.page)
        x, y = re.match(r"(?:.*: )?(\S+), (\S+)$", self.read(0, 0.5, 0.5)).groups()
        self.assertTrue(2 < float(x) < 3 and -1 < float(y) < 1, (x, y))
        self.assertIsNone(self.read(1, 0.5, 0.5), "in space there is nothing to read")
        x, y = re.match(r"(?:.*: )?(\S+), (\S+)$", self.read(5, 0.52, 0.5)).groups()
        self.assertAlmostEqual(float(x), 2, delta=0.02)
        self.assertAlmostEqual(float(y), 100, delta=4)

    def drag(self, number, begin, end):
        """A rectangle drawn with the mouse in figure `number`, from and to fractions of its size."""
        self.browser.value("""(() => { const svg = document.querySelectorAll('figure svg')[%d],
            box = svg.getBoundingClientRect(), send = (type, at) => svg.dispatchEvent(new PointerEvent(type,
                { clientX: box.left + at[0]*box.width, clientY: box.top + at[1]*box.height, bubbles: true, button: 0 }));
            send('pointerdown', %r); send('pointermove', %r); send('pointerup', %r) })()"""
                           % (number, list(begin), list(end), list(end)))

    def labels(self, number):
        """The labels of the axes of figure `number` that can be seen."""
        return self.browser.value("""Array.from(document.querySelectorAll('figure svg')[%d].querySelectorAll(
            'g[text-anchor]')).filter(g => getComputedStyle(g).display != 'none').map(g => g.textContent.trim())""" % number)

    def test_zoom(self):
        browser = self.browser
        browser.size(1400, 1000)
        browser.open(self.page)
        source = "document.querySelectorAll('figure svg')[0].querySelector('[id*=gnuplot_plot_]').parentNode.innerHTML"
        before, labels = browser.value(source), self.labels(0)
        self.drag(0, (0.4, 0.3), (0.6, 0.6))
        shown = [float(x) for x in self.labels(0) if re.match(r"-?[\d.]+$", x)]
        self.assertTrue(shown and all(1.7 <= x <= 2.9 or -0.3 <= x <= 0.7 for x in shown), shown)
        x, y = re.match(r"(?:.*: )?(\S+), (\S+)$", self.read(0, 0.5, 0.5)).groups()
        self.assertTrue(2 < float(x) < 3 and -1 < float(y) < 1, (x, y))
        browser.picture(os.path.join(FOLDER, "zoomed.png"))
        browser.value("document.querySelector('figure svg').dispatchEvent(new MouseEvent('click'))")
        self.assertEqual(len(visible(browser, "figure.large svg")), 0, "a click in a zoomed figure leaves it as it is")
        browser.value("document.querySelector('figure svg').dispatchEvent(new MouseEvent('dblclick'))")
        self.assertEqual(self.labels(0), labels)
        self.assertEqual(browser.value(source.replace("innerHTML", "querySelector('path').getAttribute('d')")),
                         re.search(r"""<path[^>]* d="([^"]*)""", before).group(1))
        self.assertEqual(browser.complaints(), [])

    def test_wheel_zooms_logarithmic_axes(self):
        browser = self.browser
        browser.size(900, 1200)
        browser.open(self.page)
        wheel = """(() => { const svg = document.querySelectorAll('figure svg')[5], box = svg.getBoundingClientRect(),
            event = new WheelEvent('wheel', { clientX: box.left + 0.5*box.width, clientY: box.top + 0.5*box.height,
                deltaY: -1, ctrlKey: %s, cancelable: true });
            for (let k = 0; k < 8; k++) svg.dispatchEvent(event);
            return event.defaultPrevented })()"""
        labels = self.labels(5)
        self.assertFalse(browser.value(wheel % "false"), "the page scrolls")
        self.assertEqual(self.labels(5), labels)
        self.assertTrue(browser.value(wheel % "true"))
        self.assertNotEqual(self.labels(5), labels)
        x, y = re.match(r"(?:.*: )?(\S+), (\S+)$", self.read(5, 0.52, 0.5)).groups()
        self.assertTrue(1.7 < float(x) < 2.3 and 50 < float(y) < 200, (x, y))

    def test_slider(self):
        self.browser.open(self.page)
        seen = self.browser.value("""(() => { const slider = document.querySelector('.frames input'),
            words = () => document.querySelector('.frames label').textContent + ' ' +
                document.querySelectorAll('.frame:not([hidden])').length;
            const first = words(); slider.value = 2; slider.dispatchEvent(new Event('input'));
            return [first, words()] })()""")
        self.assertEqual(seen, ["k = 0.5 1", "k = 2 1"])

    def test_pdf(self):
        target = os.path.join(FOLDER, "report.pdf")
        subprocess.run([PROGRAM, "report", os.path.join(FOLDER, "exam.lua"), "-o", target], stderr=subprocess.DEVNULL)
        text = subprocess.run(["pdftotext", "-layout", target, "-"], capture_output=True, text=True).stdout
        self.assertIn("The pendulum", text)
        self.assertIn("line 97", text, "folded text is printed")
        pages = text.count("\f")
        self.assertTrue(3 <= pages <= 12, pages)


if __name__ == "__main__":
    if not chromium.program():
        print("no chromium here: apt-get install chromium")
        sys.exit(1)
    FOLDER = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else \
        tempfile.mkdtemp()
    os.makedirs(FOLDER, exist_ok=True)
    unittest.main()
