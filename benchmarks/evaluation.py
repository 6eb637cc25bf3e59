"""Gain from a second process: the 15 finals evaluated by one worker and by two, in turn. The best of each counts.

Every final runs with two seeds, so the work can be halved. The agent moves the arm for a minute and ends the game, so
the figure is that of simulator and evaluation alone.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from cellwright.clients.client.client import Client
from cellwright.config.trial.catalogue import find_trial
from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, make_jobs
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError

FINALS = [f"final{number:02d}" for number in range(1, 16)]
SENSORS = "kitter_sensors"
SEEDS = (1, 2)
REPEATS = 2
"""Evaluations by one worker and by two; the best of each counts."""
MIN_GAIN = 1.9
"""Required speed of two workers compared with one."""

AHEAD, ASIDE = [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0], [2.5, 2.0, -1.0, 1.5, 3.0, -1.51, 0.0]


class Mover:
    """Agent that moves the arm to and fro for a while, and ends the game."""

    work = 60.0
    """Simulation time of a run [s]."""

    def run(self, client: Client) -> None:
        """Work the cell."""
        client.start_competition()
        while client.time < self.work:
            client.send_arm([AHEAD, ASIDE], times=[2.0, 4.0])
            client.sleep(min(4.0, self.work))
        client.end_competition()
        client.sleep(0.1)


class ShortMover(Mover):
    """The same with no simulation time."""

    work = 0.2


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Evaluate with one worker and with two.

    Raises:
        BenchmarkSkippedError: there is one processor only.
    """
    if usable_processors() < 2 and not quick:
        raise BenchmarkSkippedError("requires two processors")
    mover = ShortMover if quick else Mover
    jobs = finals(f"{mover.__module__}:{mover.__name__}", FINALS[:1] if quick else FINALS)
    spent = {1: (math.inf, 0.0), 2: (math.inf, 0.0)}
    for turn in range(1 if quick else REPEATS):
        for workers in spent:
            on_progress(f"{len(jobs)} runs, {workers} at a time, repeat {turn + 1}")
            spent[workers] = min(spent[workers], times(jobs, workers))
    for workers, (wall, busy) in spent.items():
        yield Figure(
            f"{len(jobs)} runs of {mover.work:g} s, {workers} at a time",
            len(jobs) * mover.work / wall,
            "x real time",
            note=f"{wall:.1f} s, {busy / wall:.2f} processors busy",
        )
    yield Figure("two at a time / one", spent[1][0] / spent[2][0], minimum=MIN_GAIN, note="2 is the maximum")


def finals(agent: str, names: Sequence[str]) -> list[Job]:
    """Return the runs of an agent: some finals, each with every seed."""
    files = [((name, SENSORS), (find_trial(name), find_trial(SENSORS))) for name in names]
    trials = [EvaluatedTrial(given[0], paths, 0.0, 0.0, 500.0, given=given) for given, paths in files]
    return make_jobs(trials, agent, SEEDS, vary=False)


def times(jobs: list[Job], workers: int) -> tuple[float, float]:
    """Return the wall time of all jobs, and the workers' processor time (0 where it is unknown) [s].

    Raises:
        UsageError: a run was not done.
    """
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder, ResultsFile(Path(folder)) as store:
        begin, before = time.perf_counter(), os.times()
        LocalRunner(store, workers=workers).run(jobs)
        wall, after = time.perf_counter() - begin, os.times()
        refuse_failures(store)
    busy = after.children_user + after.children_system - before.children_user - before.children_system
    return wall, busy


def refuse_failures(store: ResultsFile) -> None:
    """Raise a UsageError if a run was not done."""
    not_done = {f"{result.name}: {result.reason}" for result in store.results.values() if not result.is_done}
    if not_done:
        raise UsageError(f"not done: {', '.join(sorted(not_done))}")
