"""--licences names every shared library that the program is linked with."""
import os
import re
import subprocess
import unittest

PROGRAM = os.environ.get("PENDULA", "build/release/pendula")


class LicencesTest(unittest.TestCase):
    def test_every_library_is_named(self):
        said = subprocess.run([PROGRAM, "--licences"], capture_output=True, text=True)
        self.assertEqual(said.returncode, 0)
        linked = subprocess.run(["ldd", PROGRAM], capture_output=True, text=True).stdout
        libraries = set(re.findall(r"\b(lib[\w.+-]*?)\.so", linked))
        system = {"libc", "libm", "libstdc++", "libgcc_s", "libpthread", "libdl", "libasan", "libubsan", "librt"}
        self.assertGreater(len(libraries), 5)
        for library in sorted(libraries - system):
            self.assertRegex(said.stdout, r"(?<![\w-])%s(?![\w+-])" % re.escape(library))

    def test_every_library_opened_at_run_time_is_named(self):
        said = subprocess.run([PROGRAM, "--licences"], capture_output=True, text=True).stdout
        with open(PROGRAM, "rb") as file:
            opened = set(re.findall(rb"\0(lib\w+)\.so\.\d+(?:\0|, which)", file.read()))
        linked = subprocess.run(["ldd", PROGRAM], capture_output=True, text=True).stdout
        for library in sorted(name.decode() for name in opened):
            if library + ".so" not in linked:
                self.assertIn(library, said)

    def test_gpl_is_said(self):
        linked = subprocess.run(["ldd", PROGRAM], capture_output=True, text=True).stdout
        said = subprocess.run([PROGRAM, "--licences"], capture_output=True, text=True).stdout
        self.assertEqual("libreadline" in linked, "GNU Readline" in said)


if __name__ == "__main__":
    unittest.main()
