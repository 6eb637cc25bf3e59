"""`scripts/judge-datasets NAME`: data sets of ours before the readers and checkers of others.

`python -m tests.recording.dataset.judges NAME PYTHON` runs a judge in that Python's environment. It accepts a good set.
LeRobot must read from each frame what our own reader does. A judge must find the faults that it is known to find, and
our own check all of them.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from cellwright.recording.dataset.check import check_lerobot
from cellwright.recording.dataset.export import export_recordings
from cellwright.recording.dataset.read import DataSet
from tests.recording.dataset.judges.faults import FAULTS
from tests.recording.dataset.made import kitted
from tests.recording.dataset.sets import CAMERAS, copied, write

Judge = Callable[[str, Path], str]
"""Judges a data set by a Python; returns what is wrong, or nothing."""

_PROGRAM = Path(__file__).with_name("programs") / "lerobot_items.py"
_BLOCK = 8  # that of the program
_LEVELS = 2.0  # of 255 between decoders of video
KNOWN = {
    "lerobot": {
        "scalar as a list of one",
        "column of no feature",
        "episodes out of order",
        "shape of a feature wrong",
        "no timestamp",
    },
    "embodied-data": {"frames out of order", "fps wrong", "shape of a feature wrong", "no timestamp"},
    "lerobot-doctor": {"total_frames wrong"},
}
"""Faults that each judge finds; it reads the others without a word, or warns."""


def main(name: str, python: str) -> int:
    """Judge, and return the exit status."""
    judge, status = JUDGES[name], 0
    with TemporaryDirectory() as made:
        small, run = write(Path(made) / "small", CAMERAS), _recorded(Path(made))
        for folder in (small, run):
            problem = judge(python, folder)
            print(f"{'refused  ' if problem else 'accepted '} {name}: a good set, {folder.name} {problem}".rstrip())
            status |= bool(problem)
        for fault, damage in FAULTS.items():
            folder = copied(small, Path(made) / "damaged" / fault.replace(" ", "-"))
            damage(folder)
            ours, found = bool(check_lerobot(folder)), bool(judge(python, folder))
            is_known = found == (fault in KNOWN[name])
            words = f"{name} {'finds it' if found else 'does not'}, ours {'finds it' if ours else 'does not'}"
            print(f"{'as known ' if is_known and ours else 'DIFFERENT'} {fault}: {words}")
            status |= not (is_known and ours)
    return status


def _recorded(folder: Path) -> Path:
    """Return a set of two runs of kitter with two cameras."""
    paths = [kitted(folder / f"run{seed}.mcap", seed) for seed in (1, 2)]
    export_recordings(paths, folder / "kitter", cameras=["overhead", "wrist"])
    return folder / "kitter"


def _lerobot(python: str, folder: Path) -> str:
    with TemporaryDirectory() as made:
        out = Path(made) / "items.npz"
        ran = subprocess.run(
            [python, str(_PROGRAM), str(folder), str(out)],
            env={**os.environ, "HF_HUB_OFFLINE": "1"},
            capture_output=True,
            text=True,
        )
        if ran.returncode:
            return ran.stderr.strip().rpartition("\n")[2][:300]
        if check_lerobot(folder):
            return ""  # read without a word
        with np.load(out, allow_pickle=False) as items:
            return _difference(DataSet(folder), dict(items))


def _difference(ours: DataSet, theirs: dict[str, np.ndarray]) -> str:
    """Return where the items differ from our own reading; nothing if they are equal."""
    begin = 0
    for number in range(len(ours)):
        columns = ours.columns(number)
        rows = slice(begin, begin + len(columns["index"]))
        for name, values in columns.items():
            if not np.array_equal(theirs[name][rows].reshape(values.shape), values):
                return f"episode {number}: {name} differs"
        if {*theirs["task"][rows]} != {ours.sentence(number)}:
            return f"episode {number}: the sentence differs"
        for name in ours.videos:
            for picture, other in zip(ours.pictures(number, name), theirs[name][rows], strict=True):
                height, width = (size // _BLOCK for size in picture.shape[:2])
                cut = picture[: height * _BLOCK, : width * _BLOCK].reshape(height, _BLOCK, width, _BLOCK, 3)
                if np.abs(cut.mean(axis=(1, 3)) - other).max() > _LEVELS:
                    return f"episode {number}: {name}: a picture differs"
        begin = rows.stop
    return "" if begin == len(theirs["index"]) else f"{len(theirs['index'])} frames, not {begin}"


def _embodied_data(python: str, folder: Path) -> str:
    ran = subprocess.run(
        [str(Path(python).with_name("embodied-data")), "validate", str(folder)], capture_output=True, text=True
    )
    return (ran.stdout + ran.stderr).strip() if ran.returncode else ""


def _lerobot_doctor(python: str, folder: Path) -> str:
    command = [str(Path(python).with_name("lerobot-doctor")), str(folder), "--json"]
    ran = subprocess.run(command, capture_output=True, text=True)
    if not ran.stdout.strip():
        return ran.stderr.strip()[-300:] or "no answer"
    return ran.stdout.strip()[:300] if ran.returncode else ""


JUDGES: dict[str, Judge] = {"lerobot": _lerobot, "embodied-data": _embodied_data, "lerobot-doctor": _lerobot_doctor}

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
