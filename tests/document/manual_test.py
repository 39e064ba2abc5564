"""The manual: it is made without an error of an example, its pages are well formed, every link leads somewhere,
every documented name can be found."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from report_test import Page  # noqa: E402

PROGRAM = os.environ.get("PENDULA", "build/release/pendula")


class ManualTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = os.environ.get("PENDULA_MANUAL") or tempfile.mkdtemp()
        run = subprocess.run([PROGRAM, "manual", "-o", cls.folder], capture_output=True, text=True)
        cls.status, cls.said = run.returncode, run.stderr
        cls.pages = {}
        for name in sorted(os.listdir(cls.folder)):
            if name.endswith(".html"):
                with open(os.path.join(cls.folder, name), encoding="utf-8") as file:
                    cls.pages[name] = Page(file.read())

    def test_every_example_runs(self):
        self.assertEqual((self.status, self.said), (0, ""))

    def test_links_lead_somewhere(self):
        anchors = {name: {a["id"] for _, a in page.elements if "id" in a} for name, page in self.pages.items()}
        for name, page in self.pages.items():
            for tag, attributes in page.elements:
                for key in ("href", "src"):
                    target = attributes.get(key)
                    if target is None or re.match(r"[a-z]+:", target):
                        continue
                    file, _, anchor = target.partition("#")
                    file = file or name
                    self.assertTrue(os.path.exists(os.path.join(self.folder, file)), (name, target))
                    if anchor:
                        self.assertIn(anchor, anchors[file], (name, target))

    def test_anchors_are_unique(self):
        for name, page in self.pages.items():
            names = [a["id"] for _, a in page.elements if "id" in a]
            self.assertEqual(len(names), len(set(names)), name)

    def test_nothing_is_fetched(self):
        for name, page in self.pages.items():
            for tag, attributes in page.elements:
                if tag in ("script", "link", "img"):
                    self.assertNotRegex(attributes.get("src", attributes.get("href", "")), "^(https?:)?//", name)

    def test_examples_show_what_they_give(self):
        tutorial = self.pages["tutorial.html"]
        self.assertGreater(tutorial.count("math"), 5)
        self.assertGreaterEqual(tutorial.count("svg"), 5)
        self.assertEqual(tutorial.html.count('<pre class="code"'), tutorial.html.count('<section class="output"'))
        self.assertNotIn('role="alert"', "".join(page.html for page in self.pages.values()))

    def test_search_finds_every_name(self):
        with open(os.path.join(self.folder, "index.js"), encoding="utf-8") as file:
            source = file.read()
        index = json.loads(source[source.index("["):source.rindex("]") + 1])
        titles = {entry[0] for entry in index}
        names = subprocess.run([PROGRAM, "-e", "for name in pairs(pendula) do print(name) end"],
                               capture_output=True, text=True).stdout.split()
        libraries = {title.split(".")[0] for title in titles if "." in title}
        for name in names:
            self.assertTrue(name in titles or name in libraries, name)
        self.assertIn("model:reduce", titles)
        self.assertIn("3 A consistent start", titles)
        for _, _, address, *_ in index:
            file, _, anchor = address.partition("#")
            self.assertIn(file, self.pages)
            self.assertIn('id="%s"' % anchor.replace("&", "&amp;"), self.pages[file].html)


if __name__ == "__main__":
    unittest.main()
