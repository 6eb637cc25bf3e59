"""Time of a new process until the first step of the lesson's cell, and its memory then.

The process is new each time, and its files are in the system's cache. This is the cost of a program that is started
again and again, as in tests and CI.
"""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import pairwise

from benchmarks.benchmarks import Figure, OnProgress
from cellwright.util.errors import UsageError

RUNS = 7
LIMIT = 120.0
"""Time [s] after which a process has failed."""

PROGRAM = """
import time
moments = [time.time()]
from cellwright.cell.cell import Cell
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
moments.append(time.time())
trial = load_trial([find_trial("lesson")]).trial
moments.append(time.time())
cell = Cell(trial)
moments.append(time.time())
cell.step()
moments.append(time.time())
import json
try:
    with open("/proc/self/status", encoding="ascii") as status:
        resident = [int(line.split()[1]) / 1024 for line in status if line.startswith("VmRSS")][0]
except OSError:
    try:
        import resource
        resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2  # in bytes, where there is no /proc
    except ImportError:
        resident = None
print(json.dumps({"moments": moments, "busy": time.process_time(), "resident": resident}))
"""
"""Steps the lesson's cell once, and prints the moments [s] in between and its resident memory [MiB]."""

STEPS = ("the interpreter", "importing", "reading the trial", "building the cell", "the first step")
"""Phases between the moments, from the creation of the process on."""

COMMAND = ("-m", "cellwright", "run", "lesson", "--agent", "none", "--until", "0.002", "--no-picture", "--json")
"""A run of a single step."""


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Start processes; the fastest one counts."""
    runs = 1 if quick else RUNS
    on_progress(f"{runs} programs")
    spans, busy, resident = [], math.inf, math.nan
    for _ in range(runs):
        begin = time.time()
        report = json.loads(run_python("-c", PROGRAM))
        moments = [begin, *report["moments"]]
        spans.append([later - earlier for earlier, later in pairwise(moments)])
        busy = min(busy, report["busy"])
        if report["resident"] is not None:
            resident = report["resident"]
    totals = [sum(each) for each in spans]
    yield Figure("process until its first step", min(totals), "s", maximum=1.0, note=f"median {_median(totals)}")
    best = spans[totals.index(min(totals))]
    for label, span in zip(STEPS, best, strict=True):
        yield Figure(f"of that: {label}", span * 1e3, "ms")
    yield Figure("processor time of that process", busy, "s")
    note = "" if math.isfinite(resident) else "not reported by this system"
    yield Figure("resident memory after it", resident, "MiB", maximum=None if note else 200.0, note=note)
    on_progress(f"{runs} commands")
    commands = []
    for _ in range(runs):
        begin = time.time()
        run_python(*COMMAND)
        commands.append(time.time() - begin)
    yield Figure(
        "cellwright run of one step, from start to exit", min(commands), "s", note=f"median {_median(commands)}"
    )


def run_python(*arguments: str) -> str:
    """Run this Python with some arguments; return its output.

    Raises:
        UsageError: it failed.
    """
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=LIMIT, check=False)  # noqa: S603
    if done.returncode != 0:
        raise UsageError(f"a timed process failed: {done.stderr.strip()[-200:]}")
    return done.stdout


def _median(times: Sequence[float]) -> str:
    return f"{statistics.median(times):.2f} s of {len(times)}"
