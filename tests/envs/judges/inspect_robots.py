"""`scripts/judge-environments inspect-robots`: counts of inspect-robots, with its guardrails, beside our own.

`python -m tests.envs.judges.inspect_robots PYTHON` runs the command of that Python's environment.
"""

import json
import subprocess
import sys
import zlib
from functools import partial
from pathlib import Path

from tests.envs.judges.comparison import FIRST, compare

PROGRAM = Path(__file__).with_name("programs") / "inspect_robots_policy.py"
SEED = 7
"""Seed of the whole evaluation."""


def main(python: str) -> int:
    """Judge, and return the exit status."""
    doctor = [
        str(Path(python).with_name("inspect-robots")),
        "doctor",
        "--embodiment",
        "cellwright",
        "-E",
        f"python={sys.executable}",
    ]
    subprocess.run(doctor, check=True)
    return compare("inspect-robots", partial(_judge, python), _seeds)


def _seeds(count: int) -> list[int]:
    """Return the seeds that inspect-robots 0.60 derives for the first epoch of scenes."""
    return [zlib.crc32(f"{SEED}:{number}:0".encode()) for number in range(FIRST, FIRST + count)]


def _judge(python: str, task: str, episodes: int, shown: Path, report: Path, folder: Path) -> list[bool]:
    own = {"task": task, "python": sys.executable}
    scenes = {**own, "episodes": episodes, "seed": FIRST}
    command = [python, PROGRAM, shown, report, "run", "--task", "cellwright", "--embodiment", "cellwright"]
    command += [word for key, value in scenes.items() for word in ("-T", f"{key}={value}")]
    command += [word for key, value in {**own, "privileged": True}.items() for word in ("-E", f"{key}={value}")]
    command += ["--policy", "imitator", "--no-prompt", "--seed", SEED, "--log-dir", folder / "logs"]
    subprocess.run([*map(str, command)], check=True, cwd=folder, stdout=subprocess.DEVNULL)
    (log,) = (folder / "logs").glob("*.json")
    samples = json.loads(log.read_text())["samples"]
    return [each["reduced"]["success_at_end"] == 1.0 for each in samples]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
