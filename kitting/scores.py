"""Scores: successes of a task with their Wilson interval, as CSV of all runs and as a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from cellwright.running.evaluation.results.intervals import rate_interval
from cellwright.util.errors import UsageError
from kitting.benchmark import TASKS
from kitting.evaluate import RunRecord

COLUMNS = ("program", *(each.name for each in fields(RunRecord)))
"""Columns of the CSV, a row for each run."""


@dataclass(frozen=True, slots=True)
class Score:
    """Score of a program in a task.

    Attributes:
        successes: runs in which the task has succeeded.
        runs: all runs.
    """

    successes: int
    runs: int

    @classmethod
    def of(cls, records: Iterable[RunRecord]) -> Score:
        """Return the score of runs."""
        successes = [record.success for record in records]
        return cls(sum(successes), len(successes))

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the rate.

        Example:
            >>> [round(end, 2) for end in Score(9, 10).interval]
            [0.6, 0.98]
        """
        return rate_interval(self.successes, self.runs) or (0.0, 1.0)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.successes} of {self.runs}, {100 * low:.0f} to {100 * high:.0f} %"


def scores_of(records: Iterable[RunRecord]) -> dict[str, Score]:
    """Return the score of each task that has runs, in the order of tables."""
    by_task: dict[str, list[RunRecord]] = {}
    for record in records:
        by_task.setdefault(record.task, []).append(record)
    return {task.name: Score.of(by_task[task.name]) for task in TASKS if task.name in by_task}


def table(programs: Mapping[str, Sequence[RunRecord]]) -> str:
    """Return a table in Markdown: a row for each task, a column for each program."""
    found = {name: scores_of(records) for name, records in programs.items()}
    rows = [["task", *found], ["---"] * (1 + len(found))]
    rows += [
        [f"`{task.name}`", *(str(scores.get(task.name, "not run")) for scores in found.values())]
        for task in TASKS
        if any(task.name in scores for scores in found.values())
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def outcomes_text(programs: Mapping[str, Sequence[RunRecord]]) -> str:
    """Return all runs as CSV; equal runs give equal text, but for their wall times."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for program, records in programs.items():
        writer.writerows([program, *asdict(record).values()] for record in records)
    return text.getvalue()


def read_outcomes(path: Path) -> dict[str, list[RunRecord]]:
    """Read the CSV of `outcomes_text`: the runs of each program.

    Raises:
        UsageError: it cannot be read, or a line is none of a run.
    """
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{path}: cannot be read: {error}") from None
    if not rows or tuple(rows[0]) != COLUMNS:
        raise UsageError(f"{path}:1: must have the columns {', '.join(COLUMNS)}")
    found: dict[str, list[RunRecord]] = {}
    for number, row in enumerate(rows[1:], 2):
        try:
            program, task, seed, success, time, wall, outcome, error_class, state_hash = row
            if success not in ("True", "False"):
                raise ValueError(f"success must be True or False (got {success[:40]})")
            record = RunRecord(
                task, int(seed), success == "True", float(time), float(wall), outcome, error_class, state_hash
            )
        except ValueError as error:
            raise UsageError(f"{path}:{number}: is no run: {error}; write it with python -m kitting") from None
        found.setdefault(program, []).append(record)
    return found
