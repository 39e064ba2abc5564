"""The program without what is under the GPL (-DPENDULA_READLINE=OFF -DPENDULA_FLINT=OFF): it loads none of it, names
none of it, solves problem 1, and holds a session at a terminal."""
import os
import re
import subprocess
import tempfile
import unittest

import pexpect

ROOT = os.environ.get("PENDULA_ROOT", ".")
PROGRAM = os.environ.get("PENDULA", "build/release/pendula")
FREE = os.path.join(os.path.dirname(os.path.abspath(PROGRAM)), "tests", "pendula_without_gpl")
GPL = re.compile(r"libreadline|libtinfo|libflint|libgf2x|libntl")


def said_by(*arguments, text=None):
    run = subprocess.run([FREE, *arguments], input=text, capture_output=True, text=True, cwd=ROOT)
    return run.stdout + run.stderr


@unittest.skipUnless(os.path.exists(FREE), "only in a build tree: " + FREE)
class WithoutGplTest(unittest.TestCase):
    def test_only_the_files_compiled_anew_know_of_it(self):
        for option, file in (("READLINE", "shell/input/open_reader.cpp"), ("FLINT", "expr/polynomial/polynomial.cpp")):
            found = subprocess.run(["grep", "-rlE", r"^#\s*if.*PENDULA_%s\b" % option, "src"], capture_output=True,
                                   text=True, cwd=ROOT).stdout.split()
            whole = {"src/shell/input/readline_reader.cpp", "src/shell/input/lines_of_entry.cpp"}  # empty without it
            self.assertEqual(set(found) - whole, {"src/" + file})

    def test_nothing_under_the_gpl_is_loaded(self):
        self.assertNotRegex(subprocess.run(["ldd", FREE], capture_output=True, text=True).stdout, GPL)
        with open(FREE, "rb") as file:
            self.assertNotRegex(file.read().decode("latin-1"), r"lib(readline|flint)\.so")
        maps = said_by("-e", 'x = var "x" print(simplify((x^2 - 1)/(x - 1))) '
                             'for line in io.lines "/proc/self/maps" do print(line) end')
        self.assertIn("libgmp", maps)
        self.assertNotRegex(maps, GPL)

    def test_licences_name_no_part_under_the_gpl(self):
        text = said_by("--licences")
        self.assertRegex(text, r"GMP .*LGPL-3\.0-or-later or GPL")
        for part in re.split(r"\n\n|(?<=\.) (?=glibc)", text):
            if re.search(r"(?<!L)GPL", part):
                self.assertRegex(part, r"LGPL\S* or GPL|Runtime Library Exception")
        self.assertNotRegex(text, r"Readline|FLINT")
        self.assertNotIn("readline", said_by("--version"))

    def test_problem_1(self):
        with open(os.path.join(ROOT, "scripts/exam/problem1.out")) as file:
            self.assertEqual(said_by("scripts/exam/problem1.lua"), file.read())

    def test_session(self):
        home = tempfile.mkdtemp()
        session = pexpect.spawn(FREE, encoding="utf-8", env={"HOME": home, "TERM": "xterm", "LC_ALL": "C.UTF-8",
                                                             "PATH": os.environ["PATH"]}, timeout=20)
        session.expect("> ")
        session.sendline('x = var "x"')
        session.expect("> ")
        session.sendline("for i = 1, 2 do")              # goes on over lines
        session.expect("… ")
        session.sendline("print(diff(x^3, x), i) end")
        session.expect(r"3 x²\s+2\r\n")
        session.sendline('print "busy" while true do end')
        session.expect("\nbusy\r\n")
        session.sendintr()
        session.expect("interrupted")
        session.sendline("factor(x^2 - 1)")
        session.expect("built without")
        session.expect("> ")  # Ctrl-D before the prompt stands would be lost
        session.sendeof()
        session.expect(pexpect.EOF)
        session.close()
        self.assertEqual(session.exitstatus, 0)


if __name__ == "__main__":
    unittest.main()
