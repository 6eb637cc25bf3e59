"""Marginal cost of a subscriber, a log, a recording, another cell.

All start from one snapshot of the lesson's cell, with the belt running and the arm at rest, and continue in the same
way. They run in turn, and their processor time counts.
"""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.timing import best_in_turn, processor_time
from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.agent import KitterAgent
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.snapshot import Snapshot, restore_snapshot, take_snapshot
from cellwright.running.run import RunOptions, run_cell

BEGIN, STEPS, REPEATS = 20, 3000, 5
"""Simulation time [s] of the snapshot, steps from there, and repeats."""

MAX_UNTIMED = 2
"""Topics with at most this many messages in all the steps, such as a latched one, get no figure."""

WORK = 60.0
"""Simulation time [s] of a run of the bundled agent with and without a log."""


def lesson_cell() -> Cell:
    """Return the lesson's cell after its start, with no listeners."""
    cell = Cell(load_trial([find_trial("lesson")]).trial, seed=1)
    client = Client(InProcess(cell))
    client.start_competition()
    client.close()
    return cell


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Time listeners, the log and a second cell."""
    steps, repeats = (20, 1) if quick else (STEPS, REPEATS)
    cell = lesson_cell()
    cell.simulation.step_until((1 if quick else BEGIN) * NANOSECONDS)
    yield from _listeners(cell, take_snapshot(cell.simulation), steps, repeats, on_progress)
    on_progress("a log")
    yield from _log(0.5 if quick else WORK, repeats)
    on_progress("a recording")
    yield from _recording(0.5 if quick else WORK, repeats)
    on_progress("a second cell")
    yield from _second_cell(cell, take_snapshot(cell.simulation), steps, repeats)


def _listeners(cell: Cell, start: Snapshot, steps: int, repeats: int, on_progress: OnProgress) -> Iterator[Figure]:
    topics = cell.topics()
    listened = [(f"a subscriber to {name}", [name]) for name in _active_topics(cell, start, steps)]
    listened += [("a subscriber to every topic", topics), ("two subscribers to every topic", topics * 2)]
    on_progress(f"listeners on {len(listened) - 2} topics")
    for label, names in listened:
        received: list[str] = []
        bare, more = best_in_turn(
            repeats, partial(_run, cell, start, steps), partial(_run, cell, start, steps, names, received)
        )
        count = len(received) / repeats
        each = (more - bare) / count * 1e6 if count else math.nan
        yield Figure(f"{label} / none", more / bare, note=f"{count:.0f} messages in {steps} steps, {each:.1f} us each")


def _active_topics(cell: Cell, start: Snapshot, steps: int) -> list[str]:
    """Return the topics with a message at a rate; one that comes on an event costs too little to time."""
    received: list[str] = []
    _run(cell, start, steps, cell.topics(), received)
    counts = Counter(received)
    return [name for name in cell.topics() if counts[name] > MAX_UNTIMED]


def _run(
    cell: Cell, start: Snapshot, steps: int, topics: Sequence[str] = (), received: list[str] | None = None
) -> float:
    """Run some steps from a snapshot, with listeners that count; return their processor time [s]."""
    restore_snapshot(cell.simulation, start)
    counted = [] if received is None else received
    subscriptions = [cell.bus.subscribe(name, partial(_count, counted, name)) for name in topics]
    spent = processor_time(partial(_step, cell, steps))
    for each in subscriptions:
        each.cancel()
    return spent


def _count(received: list[str], name: str, _message: object) -> None:
    received.append(name)


def _step(cell: Cell, steps: int) -> None:
    for _ in range(steps):
        cell.step()


def _log(until: float, repeats: int) -> Iterator[Figure]:
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder:
        file = Path(folder, "run.jsonl")
        cell = Cell(load_trial([find_trial("lesson")]).trial, seed=1)

        def worked(log: Path | None) -> float:
            return processor_time(lambda: run_cell(cell, KitterAgent(), RunOptions(until=until), record=log))

        bare, more = best_in_turn(min(repeats, 3), lambda: worked(None), lambda: worked(file))
        size = file.stat().st_size / 1024
    yield Figure("a run of the agent with a log / without", more / bare, note=f"{until:g} s, {size:.1f} KiB written")


def _recording(until: float, repeats: int) -> Iterator[Figure]:
    """Yield the figures of the same run bare, with a subscriber to every topic, and recorded."""
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder:
        file = Path(folder, "run.mcap")
        cell = Cell(load_trial([find_trial("lesson")]).trial, seed=1)

        def worked(options: RunOptions, record: Path | None = None) -> float:
            return processor_time(lambda: run_cell(cell, KitterAgent(), options, record=record))

        bare, subscribed, recorded = best_in_turn(
            min(repeats, 3),
            lambda: worked(RunOptions(until=until)),
            lambda: worked(RunOptions(until=until, listen=["all"])),
            lambda: worked(RunOptions(until=until), file),
        )
        rate = file.stat().st_size / 1024 / until
    yield Figure("a run of the agent recorded / without", recorded / bare, note=f"{until:g} s, {rate:.0f} KiB each")
    yield Figure(
        "a run of the agent recorded / with subscribers", recorded / subscribed, note="a subscriber to every topic"
    )


def _second_cell(cell: Cell, start: Snapshot, steps: int, repeats: int) -> Iterator[Figure]:
    other = lesson_cell()

    def both() -> float:
        restore_snapshot(cell.simulation, start)
        restore_snapshot(other.simulation, start)

        def step() -> None:
            for _ in range(steps):
                cell.step()
                other.step()

        return processor_time(step)

    one, two = best_in_turn(repeats, partial(_run, cell, start, steps), both)
    yield Figure("two cells stepped in turn / one", two / one, note="2 when neither disturbs the other")
