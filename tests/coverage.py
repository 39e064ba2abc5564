"""The share of lines of src that ran, by folder: coverage.py root build. The counters are those of gcov."""
import collections
import gzip
import json
import os
import subprocess
import sys
import tempfile

root, build = sys.argv[1:3]
lines = collections.defaultdict(dict)  # file -> line -> did it run?
with tempfile.TemporaryDirectory() as work:
    notes = [os.path.join(folder, name) for folder, _, names in os.walk(build) for name in names
             if name.endswith(".gcno") and "/CMakeFiles/" in folder and "tests" not in folder]
    for start in range(0, len(notes), 50):
        subprocess.run(["gcov", "--json-format", *notes[start:start + 50]], cwd=work, capture_output=True, check=False)
        for name in os.listdir(work):
            with gzip.open(os.path.join(work, name)) as file:
                report = json.load(file)
            os.remove(os.path.join(work, name))
            for source in report["files"]:
                path = os.path.realpath(os.path.join(report["current_working_directory"], source["file"]))
                if not path.startswith(os.path.realpath(os.path.join(root, "src")) + os.sep):
                    continue
                for line in source["lines"]:
                    known = lines[path]
                    known[line["line_number"]] = known.get(line["line_number"], False) or line["count"] > 0
folders = collections.defaultdict(lambda: [0, 0])
for path, known in lines.items():
    counts = folders[os.path.relpath(os.path.dirname(path), root)]
    counts[0] += sum(known.values())
    counts[1] += len(known)
total = [sum(c[k] for c in folders.values()) for k in (0, 1)]
for folder in sorted(folders):
    ran, all_lines = folders[folder]
    print(f"{100*ran/max(1, all_lines):6.1f} %  {ran:6} of {all_lines:6}  {folder}")
print(f"{100*total[0]/max(1, total[1]):6.1f} %  {total[0]:6} of {total[1]:6}  src")
