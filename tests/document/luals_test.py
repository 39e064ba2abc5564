"""pendula manual --luals: every line is an annotation that the Lua language server knows, or Lua; the parameters of
the annotations are those of the functions; every documented name is there."""
import json
import os
import re
import subprocess
import unittest

PROGRAM = os.environ.get("PENDULA", "build/release/pendula")
TYPE = r'(?:[A-Za-z_][\w]*(?:\[\])?|"[^"]*")(?:\|(?:[A-Za-z_][\w]*(?:\[\])?|"[^"]*"))*'
ANNOTATIONS = {
    "meta": r"\w+", "class": r"[\w]+", "field": r"[\w]+\?? " + TYPE + r"(?: .*)?", "type": TYPE,
    "param": r"(?:[A-Za-z_]\w*\??|\.\.\.) " + TYPE, "return": TYPE, "overload": r"fun\(\.\.\.\): " + TYPE,
    "operator": r"(?:add|sub|mul|div|pow|unm|concat|len|bnot|bxor)(?:\(any\))?: " + TYPE,
}
BUILT_IN = {"any", "nil", "boolean", "number", "integer", "string", "table", "function", "float", "userdata"}


class LuaLSTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        run = subprocess.run([PROGRAM, "manual", "--luals"], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        cls.text = run.stdout
        cls.lines = run.stdout.split("\n")

    def test_it_is_lua(self):
        compiled = subprocess.run([PROGRAM, "-e", "assert(load(io.read 'a'))"], input=self.text, text=True,
                                  capture_output=True)
        self.assertEqual(compiled.returncode, 0, compiled.stderr)

    def test_annotations(self):
        for number, line in enumerate(self.lines, 1):
            match = re.match(r"---@(\w+) (.*)$", line)
            if match:
                self.assertIn(match[1], ANNOTATIONS, "line %d: %s" % (number, line))
                self.assertRegex(match[2], "^" + ANNOTATIONS[match[1]] + "$", "line %d" % number)
            else:
                self.assertNotRegex(line, "^--- ?@", "line %d" % number)

    def test_types_exist(self):
        classes = set(re.findall(r"^---@class (\w+)", self.text, re.M))
        for kind, rest in re.findall(r"^---@(param|return|type|field|operator|overload) (.*)$", self.text, re.M):
            words = rest.split(" ")
            names = words[0]
            if kind == "field":
                names = re.match(r"\S+ (%s)" % TYPE, rest)[1]
            if kind in ("operator", "overload"):
                names = words[-1]
            if kind == "param":
                names = rest.split(" ", 1)[1]
            for name in re.sub(r'"[^"]*"', "string", names).replace("[]", "").split("|"):
                self.assertIn(name, classes | BUILT_IN, rest)

    def test_parameters_are_those_of_the_function(self):
        said = []
        for line in self.lines:
            match = re.match(r"---@param (\S+?)\??(?: |$)", line)
            if match:
                said.append(match[1])
            match = re.match(r"function [\w.:]+\((.*)\) end$", line)
            if match:
                self.assertEqual(said, [name for name in match[1].split(", ") if name], line)
                self.assertEqual(len(said), len(set(said)), line)
            if not line.startswith("---"):
                said = []

    def test_everything_is_there(self):
        source = "for name, value in pairs(pendula) do print(name) end"
        names = subprocess.run([PROGRAM, "-e", source], capture_output=True, text=True).stdout.split()
        self.assertGreater(len(names), 150)
        for name in names:
            self.assertTrue(re.search(r"(?m)^(?:function %s\(|%s = )" % (name, name), self.text), name)
        for words in ("function model:reduce(form, options) end", "function rk.gauss(stages) end",
                      "function dae.semi_explicit(", '---@param form? "acc"|"ode"', "---@field dot any",
                      "---@operator bxor(any): equation", "---@field rtol? ", "---@param options model_integrate_options"):
            self.assertTrue(words in self.text, words)

    def test_snippets_are_lua(self):
        """The code of each snippet with its defaults filled in compiles."""
        folder = os.path.join(os.environ.get("PENDULA_ROOT", "."), "docs", "editor")
        for name in ("luarc.json", "vscode/tasks.json"):
            with open(os.path.join(folder, name)) as file:
                json.load(file)
        with open(os.path.join(folder, "vscode", "pendula.code-snippets")) as file:
            snippets = json.load(file)
        for name, snippet in snippets.items():
            source = "\n".join(snippet["body"])
            source = re.sub(r"\$\{\d+\|([^,|]*)[^}]*\}", r"\1", source)
            source = re.sub(r"\$\{\d+:([^}]*)\}", r"\1", source)
            source = re.sub(r"\$\d+", "", source)
            if name == "event":
                source = "return { " + source + " }"
            compiled = subprocess.run([PROGRAM, "-e", "assert(load(io.read 'a'))"], input=source, text=True,
                                      capture_output=True)
            self.assertEqual(compiled.returncode, 0, name + ": " + source + compiled.stderr)


if __name__ == "__main__":
    unittest.main()
