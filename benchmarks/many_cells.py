"""Many cells on one machine: control steps on a thread, on two threads, and in two processes; memory of a cell.

Each cell is the lesson's, and an action 20 times a second moves its arm along sines. The cells of a thread step in
turn. The engine's step lets other threads of a process run; the rest of a tick does not.

Each measurement is made by new processes, which begin together once their cells are built. The best of each counts.
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.checkout import OURS
from benchmarks.soak.memory import resident
from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.envs.stepper import CellStepper
from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.util.errors import UsageError

RATE = 20.0
"""Actions in a second of simulation time."""
COUNTS = (1, 4, 16)
"""Numbers of cells."""
STEPS, QUICK_STEPS = 4800, 16
"""Control steps of a measurement, of all cells together."""
REPEATS = 3
PROGRAM = "import sys; from benchmarks.many_cells import work; work(*map(int, sys.argv[1:]))"
"""Builds cells, waits for a line, steps them, and prints its resident memory."""

_SWING, _PERIOD = 0.2, 40  # amplitude [rad; m] and period [control steps] of the sines


@dataclass(frozen=True, order=True)
class Arrangement:
    """Arrangement of cells.

    Attributes:
        cells: number of cells, which processes and threads share evenly.
        processes: number of processes.
        threads: number of threads of each.
    """

    cells: int
    processes: int = 1
    threads: int = 1

    def __str__(self) -> str:
        """Return it in words."""
        place = f"{self.processes} processes" if self.processes > 1 else _count(self.threads, "thread")
        return f"{_count(self.cells, 'cell')}, {place}"


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Step cells in each arrangement, in turn.

    Raises:
        BenchmarkSkippedError: there is one processor only.
        UsageError: a process failed.
    """
    if usable_processors() < 2 and not quick:
        raise BenchmarkSkippedError("requires two processors")
    counts, steps = ((2,), QUICK_STEPS) if quick else (COUNTS, STEPS)
    arranged = [each for count in counts for each in arrangements(count)]
    best = dict.fromkeys(arranged, 0.0)
    memory = dict.fromkeys(arranged, math.inf)
    for turn in range(1 if quick else REPEATS):
        for each in arranged:
            on_progress(f"{each}, repeat {turn + 1}")
            rate, used = run(each, steps)
            best[each], memory[each] = max(best[each], rate), min(memory[each], used)
    for each, rate in best.items():
        yield Figure(f"{each}: control steps", rate, "/s", note=f"{rate / RATE:.0f} x real time, all cells together")
    for count in counts:
        alone = Arrangement(count)
        for each in arranged:
            if each.cells == count and each != alone:
                yield Figure(f"{each} / one thread", best[each] / best[alone], note="2 is the maximum")
    if len(counts) > 1:
        few, many = Arrangement(counts[0]), Arrangement(counts[-1])
        more = (memory[many] - memory[few]) / (many.cells - few.cells)
        yield Figure("resident memory: one more cell", more, "MiB", note=f"{memory[few]:.0f} MiB with {few.cells}")


def arrangements(count: int) -> list[Arrangement]:
    """Return the arrangements of a number of cells: on a thread, and if they can be shared, by two ways to share."""
    return [
        Arrangement(count),
        *([Arrangement(count, threads=2), Arrangement(count, processes=2)] if count > 1 else []),
    ]


def run(arrangement: Arrangement, steps: int) -> tuple[float, float]:
    """Step the cells of an arrangement.

    Args:
        arrangement: the arrangement.
        steps: control steps of all cells together.

    Returns:
        Control steps in a second of wall time, and the resident memory [MiB] of all processes.

    Raises:
        UsageError: a process failed.
    """
    share = arrangement.cells // arrangement.processes, arrangement.threads, steps // arrangement.cells
    command = [sys.executable, "-c", PROGRAM, *map(str, share)]
    pipe = subprocess.PIPE
    with ExitStack() as stack:
        workers = [
            stack.enter_context(
                subprocess.Popen(command, cwd=OURS, stdin=pipe, stdout=pipe, stderr=pipe, text=True, bufsize=1)  # noqa: S603
            )
            for _ in range(arrangement.processes)
        ]
        for worker in workers:
            _read(worker)
        begin = time.perf_counter()
        for worker in workers:
            assert worker.stdin is not None
            worker.stdin.write("go\n")
        memory = sum([float(_read(worker)) for worker in workers])
        spent = time.perf_counter() - begin
    return arrangement.cells * share[2] / spent, memory


def work(cells: int, threads: int, steps: int) -> None:
    """Build cells in this process; after a line from the standard input, step them, and print the memory [MiB]."""
    steppers = [CellStepper(Cell(load_trial("lesson")), RATE) for _ in range(cells)]
    homes = [each.read() for each in steppers]
    for stepper, home in zip(steppers, homes, strict=True):
        stepper.step(home)

    def step_all(first: int) -> None:
        for number in range(steps):
            swing = _SWING * math.sin(2.0 * math.pi * number / _PERIOD)
            for stepper, home in zip(steppers[first::threads], homes[first::threads], strict=True):
                stepper.step([value + swing for value in home])

    with ThreadPoolExecutor(threads) as pool:
        _say("ready")
        if sys.stdin.readline():
            list(pool.map(step_all, range(threads)))
            _say(str(resident()))


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _read(worker: subprocess.Popen[str]) -> str:
    """Return the next line of a process; a UsageError if it has ended."""
    assert worker.stdout is not None
    assert worker.stderr is not None
    if line := worker.stdout.readline():
        return line
    raise UsageError(f"a timed process failed: {worker.stderr.read().strip()[-300:]}")


def _count(number: int, thing: str) -> str:
    return f"1 {thing}" if number == 1 else f"{number} {thing}s"
