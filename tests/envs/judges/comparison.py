"""Comparison of a judge's episodes with our own evaluation of the same policy and seeds."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from cellwright.config.trial.catalogue import bundled_tasks
from tests.envs.judges.demonstrations import PICK, Episode, demonstrate, evaluate

FIRST, EPISODES, FEW = 1, 10, 1
"""First seed, episodes of the task that is demonstrated by an expert, and of each other task."""

Judge = Callable[[str, int, Path, Path, Path], list[bool]]
"""Runs a judge: task, number of episodes, demonstrations, report of the policy, folder for its own files.

Returns which episodes it counts as successes; the report is what `Imitator.seen` says.
"""


def compare(name: str, judge: Judge, seeds: Callable[[int], Sequence[int]]) -> int:
    """Let a judge evaluate each bundled task, print what differs from our own evaluation, and return the exit status.

    Args:
        name: name of the judge.
        judge: runs it.
        seeds: the seeds of a number of episodes.
    """
    status = 0
    for task in sorted(bundled_tasks(), key=lambda each: each != PICK):
        with TemporaryDirectory() as folder:
            shown, report = Path(folder, "shown.npz"), Path(folder, "report.json")
            own = seeds(EPISODES if task == PICK else FEW)
            demonstrate(task, own, shown)
            wanted = evaluate(task, own, shown)
            successes = judge(task, len(own), shown, report, Path(folder))
            fault = _fault(task, wanted, successes, json.loads(report.read_text()))
        print(
            f"{'DIFFERENT' if fault else 'same     '} {name}: {task}: {sum(successes)} of {len(own)} {fault}".rstrip()
        )
        status |= bool(fault)
    return status


def _fault(task: str, wanted: Sequence[Episode], successes: Sequence[bool], seen: list[list[object]]) -> str:
    ours = [each.success for each in wanted]
    if list(successes) != ours:
        return f"(ours: {ours}, judge: {list(successes)})"
    if [[each.steps, each.digest] for each in wanted] != seen:
        counts = [each.steps for each in wanted], [each[0] for each in seen]
        return f"(other observations; steps: {counts[0]}, judge: {counts[1]})"
    if task == PICK and len(set(ours)) == 1:
        return "(all episodes end alike: nothing is proven)"
    return ""
