"""Contents of the benchmark: its version, its tasks with their axes, and its seeds."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.task import Task
from cellwright.config.trial.trial import Trial
from cellwright.running.evaluation.plan.seeds import read_seeds
from cellwright.util.errors import UnknownNameError

NAME: Final = "cellwright-kitting"
VERSION: Final = "1.0.0"
"""Version of the benchmark: a change of physics, of a task or of a success raises the first number."""
ROOT: Final = Path(__file__).parent
BUILD: Final = ROOT.parent / "build" / "kitting"
"""Folder of what the commands make, unless they are given another one."""
RATE: Final = 20
"""Control periods in a second [Hz]."""


class Split(StrEnum):
    """Purpose of runs."""

    TRAIN = "train"
    TEST = "test"


@dataclass(frozen=True, slots=True)
class BenchmarkTask:
    """A task of the benchmark.

    Attributes:
        name: its name in tables.
        axis: the quantity that it varies, beside the first task.
        trained_on: name of its cell in the runs that programs learn from, where that is another one; else empty.
    """

    name: str
    axis: str
    trained_on: str = ""

    def file(self, split: Split) -> Path:
        """Return the file of its cell, in the runs of a split."""
        name = (self.trained_on if split is Split.TRAIN else "") or self.name
        return ROOT / "tasks" / f"{name}.yaml"

    def trial(self, split: Split) -> Trial:
        """Return its cell, in the runs of a split."""
        return load_trial([self.file(split)]).trial

    @property
    def task(self) -> Task:
        """Its sentence and its success, as they are tested."""
        found = self.trial(Split.TEST).task
        assert found is not None  # each file has one
        return found


TASKS: Final = (
    BenchmarkTask("pick_from_bin", "none: the reference"),
    BenchmarkTask("slow_belt", "belt speed: 0.1 m/s"),
    BenchmarkTask("fast_belt", "belt speed: 0.3 m/s"),
    BenchmarkTask("short_window", "time window: one disk, 15 s"),
    BenchmarkTask("fine_place", "tolerance: 8 mm and 0.05 rad"),
    BenchmarkTask("new_part", "unseen variant: another part and place than in training", "new_part_train"),
    BenchmarkTask("changed_order", "order change: a second order after 6 s goes first"),
    BenchmarkTask("whole_kit", "length: four parts, from a belt and two bins"),
)
"""The tasks, in the order of tables."""


def find_tasks(names: Sequence[str]) -> list[BenchmarkTask]:
    """Return tasks by their names, in the order of tables; all of them for no name.

    Raises:
        UnknownNameError: there is no such task.

    Example:
        >>> [each.name for each in find_tasks(["whole_kit", "pick_from_bin"])]
        ['pick_from_bin', 'whole_kit']
    """
    known = [each.name for each in TASKS]
    for name in names:
        if name not in known:
            raise UnknownNameError("task", name, known)
    return [each for each in TASKS if not names or each.name in names]


def seeds_file(split: Split) -> Path:
    """Return the file with the seeds of a split."""
    return ROOT / "seeds" / f"{split}.txt"


def seeds(split: Split) -> Sequence[int]:
    """Return the seeds of a split; no seed is in both."""
    return read_seeds(str(seeds_file(split)))


def digests() -> Mapping[str, str]:
    """Return the SHA-256 of each file that a score depends on, by its name: of the tasks, and of the seeds."""
    files = {path.name: path for task in TASKS for path in map(task.file, Split)}
    files |= {f"{split}.txt": seeds_file(split) for split in Split}
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in sorted(files.items())}
