"""Effect of collision culling on whole trials: `kitter` at work with culling and without, trial by trial.

`python -m tests.support.culling_effect` runs the 29 bundled trials, or the named ones; `--varied 100` adds that many
variations of them (`cellwright run --vary`), seeds 1 to 100. A reading's last bits are a command's last bits. So the
program does the same in both runs while its commands have the same order, and the same times and values within
`SAME_TIME` and `SAME_VALUE`. Up to there the positions of all parts are compared.
"""

import argparse
import dataclasses
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from fractions import Fraction
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellwright import Cell, load_trial
from cellwright.cell.variation import vary
from cellwright.clients.agents.agent import find_agent
from cellwright.config.trial.catalogue import bundled, find_trial
from cellwright.middleware.bus import ExternalInput
from cellwright.running.run.headless import run_cell
from cellwright.running.run.options import RunOptions
from tests.support.cells import with_culling

UNTIL = 600.0  # [s]
PERIOD = Fraction(1, 10)
"""Time between two comparisons of positions [s]."""
SAME_TIME, SAME_VALUE = 0.02, 1e-3  # [s], [m or rad]


class Job(NamedTuple):
    """A trial to run both ways; a seed varies it."""

    trial: str
    seed: int | None = None

    def __str__(self) -> str:
        return self.trial if self.seed is None else f"{self.trial} --vary --seed {self.seed}"


@dataclasses.dataclass
class Run:
    """One run: its result, its commands with their times [s], and the positions [m] of parts in play."""

    outcome: str
    points: float
    end: float
    collisions: int
    seconds: float
    commands: list[tuple[float, str, list[Any]]]
    positions: list[dict[str, NDArray[np.float64]]]


@dataclasses.dataclass
class Effect:
    """Comparison of both runs; times [s], `distance` [m] up to `parted`, `part` the one that is furthest off."""

    job: Job
    points: tuple[float, float]
    outcome: tuple[str, str]
    end: tuple[float, float]
    collisions: tuple[int, int]
    seconds: tuple[float, float]
    first_difference: float | None
    parted: float | None
    distance: float
    part: str

    @property
    def is_same(self) -> bool:
        """True if culling changed neither points nor outcome."""
        return self.points[0] == self.points[1] and self.outcome[0] == self.outcome[1]

    def __str__(self) -> str:
        points = f"{self.points[0]:>6g} {self.points[1]:>6g}"
        ends = f"{self.end[0]:>8.1f} {self.end[1]:>8.1f}"
        times = f"{_seconds(self.first_difference)} {_seconds(self.parted)}"
        ratio = self.seconds[1] / self.seconds[0]
        row = f"{self.job!s:<40} {points} {ends} {times} {self.distance * 1e3:>9.4f} {ratio:>6.2f}  "
        outcomes = "" if self.outcome[0] == self.outcome[1] else f", {self.outcome[0]} / {self.outcome[1]}"
        return row + ("same" if self.is_same else "DIFFERENT") + outcomes + f"  {self.part}"


_POINTS, _ENDS, _TIMES = "points on, off", "end on, off [s]", "differ, parted [s]"
HEADER = f"{'trial':<40} {_POINTS:>13} {_ENDS:>17} {_TIMES:>17} {'off [mm]':>9} {'time':>6}"


def _seconds(value: float | None) -> str:
    return f"{'-' if value is None else f'{value:.1f}':>8}"


def leaves(value: Any) -> Iterator[Any]:
    """Yield the numbers and texts of a message."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from leaves(getattr(value, field.name))
    elif isinstance(value, list | tuple | np.ndarray):
        for each in value:
            yield from leaves(each)
    else:
        yield value


def work(job: Job, *, culling: bool) -> Run:
    """Run a job."""
    sensors = [] if job.trial == "lesson" else [find_trial("kitter_sensors")]
    trial = with_culling(load_trial(find_trial(job.trial), *sensors), culling)
    cell = Cell(trial if job.seed is None else vary(trial, job.seed), seed=job.seed)
    commands: list[tuple[float, str, list[Any]]] = []
    positions: list[dict[str, NDArray[np.float64]]] = []

    def note(given: ExternalInput) -> None:
        commands.append((cell.simulation.time, given.name, list(leaves(given.message))))

    def look(_number: int) -> None:
        names, in_play = [part.name for part in cell.parts.all], cell.parts.in_play
        found = zip(names, cell.parts.positions(), strict=True)
        positions.append({name: position for name, position in found if name in in_play})

    cell.bus.on_input.append(note)
    cell.simulation.watch("culling effect", PERIOD, look)
    begin = time.process_time()
    result = run_cell(cell, find_agent("kitter")(), RunOptions(until=UNTIL))
    seconds = time.process_time() - begin
    points = result.score.total
    collisions = len(result.collisions)
    return Run(str(result.outcome), points, cell.simulation.time, collisions, seconds, commands, positions)


def is_same_command(one: tuple[float, str, list[Any]], other: tuple[float, str, list[Any]]) -> bool:
    """Return whether two commands are the same within `SAME_TIME` and `SAME_VALUE`."""
    if one[1] != other[1] or abs(one[0] - other[0]) > SAME_TIME or len(one[2]) != len(other[2]):
        return False
    return all(
        abs(a - b) <= SAME_VALUE if isinstance(a, float) and isinstance(b, float) else a == b or type(a) is int
        for a, b in zip(one[2], other[2], strict=True)
    )


def compare(job: Job) -> Effect:
    """Run a job with culling and without, and compare."""
    on, off = work(job, culling=True), work(job, culling=False)
    first, parted = None, None
    for one, other in zip_longest(on.commands, off.commands):
        if first is None and one != other:
            first = min(each[0] for each in (one, other) if each)
        if one is None or other is None or not is_same_command(one, other):
            parted = min(each[0] for each in (one, other) if each)
            break
    distance, part = 0.0, ""
    for number, (one, other) in enumerate(zip(on.positions, off.positions, strict=False)):
        if parted is not None and number * PERIOD >= parted:
            break
        for name in one.keys() & other.keys():
            apart = float(np.linalg.norm(one[name] - other[name]))
            if apart > distance:
                distance = apart
                part = f"{name} at {float(number * PERIOD):.1f} s" if distance > 1e-3 else ""
    return Effect(
        job,
        (on.points, off.points),
        (on.outcome, off.outcome),
        (on.end, off.end),
        (on.collisions, off.collisions),
        (on.seconds, off.seconds),
        first,
        parted,
        distance,
        part,
    )


def main(arguments: list[str]) -> int:
    """Compare on two cores; return 1 if points or outcome of a trial differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trials", nargs="*", help="bundled trials (default: all)")
    parser.add_argument("--varied", type=int, default=0, metavar="COUNT", help="varied trials in addition")
    parser.add_argument("--from", type=int, default=1, dest="first", metavar="SEED", help="their first seed")
    parser.add_argument("--only-varied", action="store_true", help="leave out the trials as written")
    parser.add_argument("--workers", type=int, default=2, metavar="COUNT")
    options = parser.parse_args(arguments)
    trials = options.trials or list(bundled())
    jobs = [] if options.only_varied else [Job(trial) for trial in trials]
    seeds = range(options.first, options.first + options.varied)
    jobs += [Job(trials[seed % len(trials)], seed) for seed in seeds]
    effects: list[Effect] = []
    print(HEADER)
    with ProcessPoolExecutor(options.workers) as pool:
        for done in as_completed([pool.submit(compare, job) for job in jobs]):
            effects.append(done.result())
            print(effects[-1], f" [{len(effects)} of {len(jobs)}]", flush=True)
    different = [each for each in effects if not each.is_same]
    points = np.array([each.points for each in effects])
    print(f"{len(effects) - len(different)} of {len(effects)} score the same; {points.mean(axis=0)} points on average")
    print(*different, sep="\n")
    return bool(different)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
