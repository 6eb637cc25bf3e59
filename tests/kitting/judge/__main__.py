"""`scripts/judge-datasets mlcroissant`: it reads `croissant.json` without a warning, and each run as the file has it.

`python -m tests.kitting.judge PYTHON` runs it in that Python's environment.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

from kitting.croissant import FILE, RESULTS

_PROGRAM = Path(__file__).with_name("records.py")


def main(python: str) -> int:
    """Judge, and return the exit status."""
    ran = subprocess.run([python, str(_PROGRAM), str(FILE)], capture_output=True, text=True)
    if ran.returncode:
        print(f"refused   mlcroissant: {ran.stderr.strip()[-1000:]}")
        return 1
    read = json.loads(ran.stdout)
    with RESULTS.open(encoding="utf-8", newline="") as file:
        rows = [{f"runs/{name}": value for name, value in row.items()} for row in csv.DictReader(file)]
    numbers = ("runs/time", "runs/wall")
    for row in (*read["runs"], *rows):
        row.update({name: str(float(row[name])) for name in numbers})
    is_same = read == {"runs": rows}
    print(f"{'accepted ' if is_same else 'DIFFERENT'} mlcroissant: {len(read['runs'])} of {len(rows)} runs")
    return int(not is_same)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
