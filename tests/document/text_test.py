"""Text of reports: Markdown as HTML, LaTeX as MathML. Fixed cases, and random text that must stay well formed."""
import os
import random
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from report_test import Page  # noqa: E402

PROGRAM = os.environ.get("PENDULA", "build/release/pendula")

FORMULAS = [
    (r"\frac{a}{b}", "<mfrac><mi>a</mi><mi>b</mi></mfrac>"),
    (r"\frac12", "<mfrac><mn>1</mn><mn>2</mn></mfrac>"),
    (r"x^10", "<msup><mi>x</mi><mn>1</mn></msup><mn>0</mn>"),
    (r"x^{10}", "<msup><mi>x</mi><mn>10</mn></msup>"),
    (r"x_1^2", "<msubsup><mi>x</mi><mn>1</mn><mn>2</mn></msubsup>"),
    (r"x^2_1", "<msubsup><mi>x</mi><mn>1</mn><mn>2</mn></msubsup>"),
    (r"f''", "<msup><mi>f</mi><mo>″</mo></msup>"),
    (r"\dot{x}", '<mover accent="true"><mi>x</mi><mo>˙</mo></mover>'),
    (r"\dot x", '<mover accent="true"><mi>x</mi><mo>˙</mo></mover>'),
    (r"\sqrt[3]{x}", "<mroot><mi>x</mi><mn>3</mn></mroot>"),
    (r"\mathbf{p}_1^\top", "<msubsup><mi>𝐩</mi><mn>1</mn><mi>⊤</mi></msubsup>"),
    (r"\boldsymbol{\theta}", "<mi>𝜽</mi>"),
    (r"\mathbb{R}^n", "<msup><mi>ℝ</mi><mi>n</mi></msup>"),
    (r"\mathrm{eq}", '<mi mathvariant="normal">eq</mi>'),
    (r"\sin\left(x\right)", "<mi>sin</mi><mo>\u2061</mo>"),
    (r"\sin^2 x", '<msup><mi>sin</mi><mn>2</mn></msup><mo>\u2061</mo><mspace width="0.17em"></mspace><mi>x</mi>'),
    (r"2\exp(x)", '<mn>2</mn><mspace width="0.17em"></mspace><mi>exp</mi><mo>\u2061</mo><mo stretchy="false">(</mo>'),
    (r"f(0) + x", '<mo stretchy="false">)</mo><mo>+</mo><mi>x</mi>'),
    (r"a/b", '<mi>a</mi><mo lspace="0" rspace="0">/</mo><mi>b</mi>'),
    (r"\sum_{i=1}^n i", "<munderover><mo>∑</mo>"),
    (r"\begin{cases} 1 & x < 0 \\ 2 & \text{else} \end{cases}", "<mtext>else</mtext>"),
    (r"\begin{align} a &= b \tag{1} \\ c &= d \tag{2} \end{align}", '<mtd class="tag"><mtext>(2)</mtext></mtd>'),
    (r"\begin{array}{c|c} 0 & 1 \\ \hline & 2 \end{array}", 'class="center line-left line-above"'),
    (r"-x", '<mo form="prefix">−</mo>'),
    (r"a - x", "<mo>−</mo>"),
    (r"a = -x", '<mo form="prefix">−</mo>'),
    (r"1.5 \cdot 10^{-9}", '<msup><mn>10</mn><mrow><mo form="prefix">−</mo><mn>9</mn></mrow></msup>'),
    (r"\unknown{x}", "<mtext>\\unknown</mtext>"),
    (r"a < b & c", "<mo>&lt;</mo>"),
    (r"<script>", "<mo>&lt;</mo>"),
]

PIECES = (r"\frac \sqrt \left \right ( ) [ ] { } ^ _ & \\ \begin{cases} \end{cases} \begin{bmatrix} \end{bmatrix} \begin "
          r"\end \text \mathbf \mathrm ' '' x 12 3.5 + - < > \" = \sum \int \dot \tag \hline \unknown ~ \, \% \{ \}").split()
LINES = ["# head", "## <b>", "* item", "  * inner", "1. one", "| a | b |", "|---|---|", "> quote", "```lua", "```", "$$",
         "$x$", "$a_1", "`code`", "**bold", "*em*", "[a](b)", "[a](javascript:b)", "<a id=\"x\"></a>", "<script>", "---",
         "", "    indented", "\\* \\", "a|b", "&amp;", "\x00\x1b[1m", "_x_ a_b_c", "![i](u)"]


class TextTest(unittest.TestCase):
    def pages(self, texts):
        """One report with every text as a section of its own, cut at its headings."""
        folder = tempfile.mkdtemp()
        script = os.path.join(folder, "exam.lua")
        with open(script, "w") as file:
            for text in texts:
                file.write("--- # section\n" + "".join("--- %s\n" % line for line in text.split("\n")) + "x = 1\n")
        run = subprocess.run([PROGRAM, "report", script, "-o", script + ".html"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(script + ".html") as file:
            html = file.read()
        Page(html)                                     # well formed
        sections = re.split(r'<h1 id="section">section</h1>', html)[1:]
        self.assertEqual(len(sections), len(texts))
        return sections

    def test_formulas(self):
        sections = self.pages(["$$\n%s\n$$" % latex for latex, _ in FORMULAS])
        for (latex, expected), html in zip(FORMULAS, sections):
            self.assertIn(expected, html, latex)

    def test_markdown(self):
        cases = [("a **b** *c* `d < e` _f_ g_h_i", "a <strong>b</strong> <em>c</em> <code>d &lt; e</code> <em>f</em> g_h_i"),
                 ("costs $5 and $6", "costs $5 and $6"), ("$x$ and $y$", "</math> and <math>"),
                 ("[a](b.html#c)", '<a href="b.html#c">a</a>'), ("[a](JavaScript:b)", '<a href="#">a</a>'),
                 ("* a\n* b\n  * c", "<ul>\n<li>a</li>\n<li>b\n<ul>\n<li>c</li>\n</ul></li>\n</ul>"),
                 ("1. a\n2. b", "<ol>\n<li>a</li>\n<li>b</li>\n</ol>"), ("> a\n> b", "<blockquote><p>a\nb</p></blockquote>"),
                 ("| a | b |\n|---|---|\n| `x|y` | 2 |", "<td><code>x|y</code></td><td>2</td>"),
                 ("text\n\n    W q = r\n    0 = C", "<code>W q = r\n0 = C</code>"),
                 ("```lua\nx = 1 -- c\n```", '<span class="n">1</span> <span class="c">-- c</span>'),
                 ("<b>a</b>", "&lt;b&gt;a&lt;/b&gt;"), ('<a id="here"></a>', '<a id="here"></a>')]
        for (source, expected), html in zip(cases, self.pages([source for source, _ in cases])):
            self.assertIn(expected, html, source)

    def test_random_text_stays_well_formed(self):
        generator = random.Random(1)
        texts = ["$$\n%s\n$$" % " ".join(generator.choices(PIECES, k=generator.randint(1, 30))) for _ in range(300)]
        texts += ["\n".join(generator.choices(LINES, k=generator.randint(1, 12))) for _ in range(300)]
        texts.append("$$\n" + "{" * 5000 + "\n$$")
        texts.append("$" + r"\left(" * 400 + "x$")
        folder = tempfile.mkdtemp()
        script = os.path.join(folder, "exam.lua")
        with open(script, "w") as file:
            for text in texts:
                file.write("".join("--- %s\n" % line for line in text.split("\n")) + "x = 1\n")
        run = subprocess.run([PROGRAM, "report", script, "-o", script + ".html"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        with open(script + ".html") as file:
            page = Page(file.read())
        self.assertEqual(page.count("script"), 1)
        self.assertEqual(page.count("img"), 0)
        for _, attributes in page.elements:
            self.assertNotIn("javascript", attributes.get("href", "").lower())


if __name__ == "__main__":
    unittest.main()
