"""Gain from a second CPU of a Ray cluster, and the cost of Ray: finals with one run at a time and with two, in turn.

The cluster is on this machine, so Ray's own processes share its processors with the runs. The agent is that of
`evaluation`, and moves the arm for four minutes. The best of each counts.

Ray's start and end, a copy of the folder and the check of the agent take a constant time, a figure of its own.
"""

from __future__ import annotations

import inspect
import math
import tempfile
import time
from collections.abc import Iterator
from contextlib import chdir
from importlib.util import find_spec
from pathlib import Path

from benchmarks import evaluation
from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.evaluation import FINALS, MIN_GAIN, REPEATS, Mover
from cellwright.running.evaluation.execution.on_ray.runner import RayRunner
from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import Job
from cellwright.running.evaluation.results.results_file import ResultsFile
from cellwright.util.errors import UsageError

WORK = 240.0
"""Simulation time of a run [s]."""


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Evaluate on a local cluster with one run at a time and with two, and without Ray.

    Raises:
        BenchmarkSkippedError: Ray is not installed, or there is one processor only.
    """
    if find_spec("ray") is None:
        raise BenchmarkSkippedError("requires ray")
    if usable_processors() < 2 and not quick:
        raise BenchmarkSkippedError("requires two processors")
    work = 0.2 if quick else WORK
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder, chdir(folder):
        Path("mover.py").write_text(_source(work), encoding="utf-8")
        jobs = evaluation.finals("mover.py:Agent", FINALS[:1] if quick else FINALS)
        spent = {1: math.inf, 2: math.inf}
        start = plain = math.inf
        for turn in range(1 if quick else REPEATS):
            for most in spent:
                on_progress(f"{len(jobs)} runs on Ray, {most} at a time, repeat {turn + 1}")
                started, ran = _times(jobs, most)
                start, spent[most] = min(start, started), min(spent[most], ran)
            on_progress(f"{len(jobs)} runs without Ray, 2 at a time, repeat {turn + 1}")
            plain = min(plain, evaluation.times(jobs, 2)[0])
    runs = f"{len(jobs)} runs of {work:g} s"
    for name, wall in ((f"{runs} on Ray, 1 at a time", spent[1]), (f"{runs} on Ray, 2 at a time", spent[2])):
        yield Figure(name, len(jobs) * work / wall, "x real time", note=f"{wall:.1f} s")
    yield Figure(f"{runs}, `--jobs 2`", len(jobs) * work / plain, "x real time", note=f"{plain:.1f} s")
    yield Figure("two at a time / one", spent[1] / spent[2], minimum=MIN_GAIN, note="2 is the maximum")
    yield Figure("Ray / `--jobs 2`", spent[2] / plain, note="time for the same runs")
    yield Figure("start and end of Ray, and check of the agent", start, "s")


def _source(work: float) -> str:
    """Return the file of an agent that works for a time [s]: nodes have Cellwright alone, and no benchmarks."""
    head = "from cellwright.clients.client.client import Client"
    places = f"AHEAD, ASIDE = {evaluation.AHEAD}, {evaluation.ASIDE}"
    return "\n\n".join((head, places, inspect.getsource(Mover), f"class Agent(Mover):\n    work = {work}\n"))


def _times(jobs: list[Job], most: int) -> tuple[float, float]:
    """Return the wall times [s] of Ray's start and end with the check of the agent, and of the runs."""
    ends: list[float] = []
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder, ResultsFile(Path(folder)) as store:
        begin = time.perf_counter()
        options = RunnerOptions(on_result=lambda _: ends.append(time.perf_counter()))
        runner = RayRunner(store, "local", jobs, options, most=most)
        problem = runner.check_agent(jobs[0].agent)
        begun = time.perf_counter()
        if problem or runner.failure or not runner.run(jobs):
            raise UsageError(problem or runner.failure or ", ".join(each.line for each in runner.lost))
        end = time.perf_counter()
        evaluation.refuse_failures(store)
    return begun - begin + end - ends[-1], ends[-1] - begun
