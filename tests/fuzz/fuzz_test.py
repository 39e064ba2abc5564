"""A short run of the fuzzers on fixed seeds; ./dev fuzz runs them for as long as one likes, with sanitizers."""
import os
import subprocess
import sys

here = os.path.dirname(os.path.abspath(__file__))
done = subprocess.run([sys.executable, os.path.join(here, "run.py"), "8", os.environ["PENDULA"]], timeout=110)
sys.exit(done.returncode)
