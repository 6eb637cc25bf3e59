"""Runs of a program in tasks of the benchmark, by `cellwright eval`, and their outcomes."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cellwright.running.evaluation.results.folder import RECORDINGS, read_plan
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError
from kitting.benchmark import ROOT, TASKS, BenchmarkTask, Split, seeds

SEEDS_NAME = "seeds.txt"
"""File beside the results with the seeds of the runs."""
_RAN = (0, 1)  # exit statuses of an evaluation whose runs are all over


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Published record of a run.

    Attributes:
        task: name of the task.
        seed: its seed.
        success: True if the task has succeeded.
        time: simulation time that passed [s].
        wall: wall time that it took [s]; not the same on another machine.
        outcome: outcome, as in `cellwright eval`.
        error_class: `none`, `policy` or `simulation`.
        state_hash: SHA-256 of the last state.
    """

    task: str
    seed: int
    success: bool
    time: float
    wall: float
    outcome: str
    error_class: str
    state_hash: str


@dataclass(frozen=True, slots=True)
class Runs:
    """Runs to do.

    Attributes:
        tasks: the tasks.
        split: their purpose.
        count: number of seeds of each task, the first of the split; None for all.
        jobs: runs at a time; None for the number of processors.
        record: True to record each run.
        fresh: True to repeat runs that have a result, as of a program whose files have changed.
    """

    tasks: Sequence[BenchmarkTask]
    split: Split = Split.TEST
    count: int | None = None
    jobs: int | None = None
    record: bool = False
    fresh: bool = False

    @property
    def seeds(self) -> Sequence[int]:
        """The seeds; a UsageError if the split has not as many."""
        found = seeds(self.split)
        if self.count is not None and not 1 <= self.count <= len(found):
            raise UsageError(f"--seeds {self.count}: give a number from 1 to {len(found)}, as many as {self.split} has")
        return found[: self.count]


def evaluate(runs: Runs, words: Sequence[str], folder: Path) -> list[RunRecord]:
    """Run a program, and return the records in the order of the plan; what the folder has a result of is not repeated.

    Args:
        runs: the runs.
        words: options of `cellwright eval` that name the program, such as `--agent kitter`.
        folder: folder for results, logs and recordings.

    Raises:
        UsageError: the evaluation did not end; the folder has what it wrote, and it has printed why.
    """
    numbers = runs.seeds
    files = [str(task.file(runs.split)) for task in runs.tasks]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / SEEDS_NAME).write_text("".join(f"{number}\n" for number in numbers), encoding="utf-8")
    more = [] if runs.jobs is None else ["--jobs", str(runs.jobs)]
    more += [option for option, is_set in (("--record", runs.record), ("--fresh", runs.fresh)) if is_set]
    command = [sys.executable, "-m", "cellwright", "eval", *files, *words, "--vary", "--out", str(folder.resolve())]
    command += ["--seeds", str((folder / SEEDS_NAME).resolve()), *more]
    # the folder of this package, so that programs in it are found by their module
    status = subprocess.run(command, cwd=ROOT.parent, check=False).returncode  # noqa: S603 - our own words
    if status not in _RAN:
        raise UsageError(f"{folder}: the evaluation ended with status {status}; see above, and run the command again")
    return records(folder)


def records(folder: Path) -> list[RunRecord]:
    """Return the records of an evaluation, in the order of its plan.

    Raises:
        UsageError: the folder has no evaluation of this benchmark, or another one uses it.
    """
    names = {task.file(split).stem: task.name for task in TASKS for split in Split}
    with ResultsFile(folder) as store:
        found = [store.results[run["key"]] for run in read_plan(folder)["runs"] if run["key"] in store.results]
    if strange := next((each.trial for each in found if each.trial not in names), None):
        raise UsageError(f"{folder}: has runs of {strange}, which is no task of the benchmark; give another folder")
    return [_record(result, names[result.trial]) for result in found]


def recordings(folder: Path, task: BenchmarkTask, split: Split) -> list[Path]:
    """Return the recordings of a task in the folder of an evaluation, by their seeds.

    Raises:
        UsageError: there is none.
    """
    name = task.file(split).stem
    with ResultsFile(folder) as store:
        newest = {each.seed: each for each in store.results.values() if each.trial == name}  # of several sources
    files = [(folder / RECORDINGS / newest[seed].log_name).with_suffix(".mcap") for seed in sorted(newest)]
    found = [file for file in files if file.is_file()]
    if not found:
        raise UsageError(f"{folder}: has no recording of {name}; run python -m kitting demonstrate")
    return found


def _record(result: Result, task: str) -> RunRecord:
    return RunRecord(
        task=task,
        seed=result.seed,
        success=bool(result.success),
        time=round(result.simulated, 3),
        wall=round(result.wall, 2),
        outcome=result.outcome,
        error_class=result.error_class,
        state_hash=result.state_hash,
    )
