"""What a second process brings: the 15 finals evaluated by one worker and by two, in turn, in one run.

Run with `python benchmarks/eval_scaling.py [ROUNDS]` on a machine with two idle processors or more. Every final runs
with two seeds, so that the work can be halved; the program moves the arm for a minute and ends the game, so that the
figure is that of the simulator and of the evaluation, whoever plays.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

from cellwright.client.client import Client
from cellwright.description.catalogue import find_trial
from cellwright.evaluation.evaluate import Evaluation
from cellwright.evaluation.job import EvaluatedTrial, Job, make_jobs
from cellwright.evaluation.results_file import ResultsFile

FINALS = [f"final{number:02d}" for number in range(1, 16)]
SENSORS = "kitter_sensors"
SEEDS = (1, 2)
WORK = 60.0
"""Simulation time of a run [s]."""

AHEAD, ASIDE = [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0], [2.5, 2.0, -1.0, 1.5, 3.0, -1.51, 0.0]


class Mover:
    """Moves the arm to and fro for a while, and ends the game."""

    def run(self, client: Client) -> None:
        """Work the cell."""
        client.start_competition()
        while client.time < WORK:
            client.send_arm([AHEAD, ASIDE], times=[2.0, 4.0])
            client.sleep(4.0)
        client.end_competition()
        client.sleep(0.1)


def main() -> None:
    """Print wall times and their ratio."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 1
    trials = [EvaluatedTrial(name, (find_trial(name), find_trial(SENSORS)), 0.0, 0.0, 500.0) for name in FINALS]
    jobs = make_jobs(trials, f"{__file__}:Mover", SEEDS, vary=False)
    print(f"{len(jobs)} runs of {WORK:g} s, {os.cpu_count()} processors{load()}")
    best = {workers: min(times(jobs, workers) for _ in range(rounds)) for workers in (1, 2)}
    for workers, (wall, busy) in best.items():
        print(
            f"{workers} at a time: {wall:6.1f} s, {len(jobs) * WORK / wall:5.0f} x real time, all told; "
            f"{busy:.1f} s of processor time, {busy / wall:.2f} processors"
        )
    print(f"ratio: {best[1][0] / best[2][0]:.2f}")


def load() -> str:
    """How busy the machine is before anything starts, where that can be told: it should be idle."""
    return f", load {os.getloadavg()[0]:.1f}" if sys.platform != "win32" else ""


def times(jobs: list[Job], workers: int) -> tuple[float, float]:
    """Wall time that all jobs take, and processor time of the workers (0 where it is not told) [s]."""
    with tempfile.TemporaryDirectory() as folder, ResultsFile(Path(folder)) as store:
        begin, before = time.perf_counter(), os.times()
        Evaluation(store, workers=workers).run(jobs)
        wall, after = time.perf_counter() - begin, os.times()
        not_done = {result.reason for result in store.results.values() if not result.is_done}
        if not_done:
            sys.exit(f"not done: {not_done}")
    busy = after.children_user + after.children_system - before.children_user - before.children_system
    return wall, busy


if __name__ == "__main__":
    main()
