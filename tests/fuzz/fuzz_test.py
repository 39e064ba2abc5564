"""A short run of the fuzzers on fixed seeds; ./dev fuzz runs them for as long as one likes, with sanitizers."""
import os
import subprocess
import sys

here = os.path.dirname(os.path.abspath(__file__))
environment = dict(os.environ, FUZZ_SEED="1", FUZZ_LAST="12")
done = subprocess.run([sys.executable, os.path.join(here, "run.py"), "100", os.environ["PENDULA"]], timeout=110,
                      env=environment)
sys.exit(done.returncode)
