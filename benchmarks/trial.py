"""Cost of a whole trial of 500 s (`trial.yaml`), compared with its engine alone.

The bundled agent works it once, and its commands are recorded. A second cell without subscribers replays them. The
agent works a third one, in which every topic has a subscriber. Their final states are equal, so the engine did the same
work in each. Its time (`engine_time.py`) is the reference.

`--against FOLDER` compares the run of the agent with that of another checkout, by processor time. Each run is a new
process; both checkouts run in turn, and the best run of each counts.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.checkout import OURS, Checkout
from benchmarks.engine_time import EngineTime, engine_timed
from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.agent import KitterAgent
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import NANOSECONDS
from cellwright.recording.format.commands import Command, note_commands
from cellwright.util.errors import RunEndedError, UsageError

SECONDS, QUICK_SECONDS = 500, 2
"""Simulation time of a run [s]."""
NODE = "/agent"
IN_TURN = 2
"""Repeats of a replayed run, which is short beside the others, and of each compared checkout; the best counts."""
MIN_SPEED_UP = 1.4
"""Required speed of a whole trial compared with commit 1bcd8c5c."""
MAX_RATIOS = 1.25, 1.7, 2.2
"""Goals of run / engine: without subscribers, with the agent, and with a subscriber to every topic as well."""

PROGRAM = """
import json, sys, time
from benchmarks.trial import run_with_agent
begin = time.process_time()
run, _commands = run_with_agent(int(sys.argv[1]))
print(json.dumps([time.process_time() - begin, run.engine / run.wall, run.steps]))
"""
"""Runs the trial with the agent; prints its processor time [s], its engine's share and its steps."""


@dataclass(frozen=True)
class FinishedRun:
    """Figures of a finished run.

    Attributes:
        wall: wall time, without the timing [s].
        engine: the engine's share of that [s].
        steps: ticks.
        state_hash: of the cell at its end.
    """

    wall: float
    engine: float
    steps: int
    state_hash: str

    @property
    def ratio(self) -> float:
        """Ratio of its time to its engine's time."""
        return self.wall / self.engine


def bench_trial() -> Trial:
    """Return the trial bundled with this package."""
    with as_file(files("benchmarks") / "trial.yaml") as path:
        return load_trial([path]).trial


def run_with_agent(seconds: int, *, topics: Sequence[str] | None = ()) -> tuple[FinishedRun, list[Command]]:
    """Run the trial with the agent; return the run, and the agent's commands.

    Args:
        seconds: duration [s].
        topics: additional topics with a listener; None for every topic.
    """
    with engine_timed() as engine:
        cell = Cell(bench_trial())
        heard: list[None] = []
        for name in cell.topics() if topics is None else topics:
            cell.bus.subscribe(name, lambda _message: heard.append(None), node="/listener")
        transport = InProcess(cell, node=NODE)
        transport.stop.limit(seconds * NANOSECONDS)
        commands: list[Command] = []
        note_commands(cell.bus, cell.simulation.clock, commands.append)
        begin = time.perf_counter()
        client = Client(transport)
        try:
            KitterAgent().run(client)
            client.wait_until(lambda: False)
        except RunEndedError:
            pass
        return _finished_run(cell, engine, time.perf_counter() - begin), commands


def replay(seconds: int, commands: Sequence[Command]) -> FinishedRun:
    """Replay the agent's commands into a cell without listeners."""
    with engine_timed() as engine:
        cell = Cell(bench_trial())
        begin = time.perf_counter()
        for command in commands:
            cell.simulation.step_until(cell.simulation.clock.time_of(command.tick))
            command.carry_out(cell.bus)
        cell.simulation.step_until(seconds * NANOSECONDS)
        return _finished_run(cell, engine, time.perf_counter() - begin)


def _finished_run(cell: Cell, engine: EngineTime, wall: float) -> FinishedRun:
    ticks = cell.simulation.clock.tick
    if engine.steps != ticks:
        raise RuntimeError(f"{engine.steps} of {ticks} steps were timed")
    return FinishedRun(wall - engine.overhead, engine.spent, ticks, cell.state_hash())


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Run the trial without listeners, with the agent, and with a subscriber to every topic."""
    seconds = QUICK_SECONDS if quick else SECONDS
    on_progress("a run with the agent")
    agent, commands = run_with_agent(seconds)
    on_progress("runs without subscribers")
    alone = min((replay(seconds, commands) for _ in range(1 if quick else IN_TURN)), key=lambda run: run.ratio)
    yield from figures("without subscribers", alone, seconds, MAX_RATIOS[0])
    yield from figures("the agent kitter at work", agent, seconds, MAX_RATIOS[1])
    on_progress("a run with a subscriber to every topic")
    observed, _ = run_with_agent(seconds, topics=None)
    label = "the agent kitter at work, a subscriber to every topic"
    yield from figures(label, observed, seconds, MAX_RATIOS[2])
    parts = len(Cell(bench_trial()).parts.names)
    yield Figure(
        "the engine alone", alone.engine / alone.steps * 1e6, "us/step", note=f"{parts} parts, {len(commands)} commands"
    )
    hashes = {run.state_hash for run in (agent, alone, observed)}
    yield Figure("different end states of the three", len(hashes), "", maximum=1, note=f"{agent.state_hash[:12]}…")


def compare(folder: Path, on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Run the trial with the agent here and in another checkout, in turn.

    Raises:
        UsageError: the other checkout has another trial, or a run failed.
    """
    ours, theirs = Checkout(OURS), Checkout(folder)
    own, other = ((each.folder / "benchmarks" / "trial.yaml").read_bytes() for each in (ours, theirs))
    if own != other:
        raise UsageError(f"{folder}: benchmarks/trial.yaml is not the trial of this checkout; compare equal trials")
    seconds = str(QUICK_SECONDS if quick else SECONDS)
    found: dict[Checkout, list[tuple[float, float, int]]] = {ours: [], theirs: []}
    for turn in range(1 if quick else IN_TURN):
        for name, checkout in (("this checkout", ours), ("the other checkout", theirs)):
            on_progress(f"{name}, run {turn + 1}")
            found[checkout].append(checkout.run(PROGRAM, seconds))
    best = [min(runs) for runs in found.values()]
    commit = theirs.commit
    for name, (spent, share, steps) in zip(("this checkout", "the other checkout"), best, strict=True):
        note = f"{share * spent / steps * 1e6:.1f} us/step engine, {(1 - share) * spent / steps * 1e6:.1f} all else"
        yield Figure(f"{name}: processor time of a trial with the agent", spent, "s", note=note)
    (own_time, own_share, _), (time_before, share_before, _) = best
    yield Figure(
        "this checkout: speed / the other checkout",
        time_before / own_time,
        minimum=MIN_SPEED_UP,
        note=f"the other one is {commit}" if commit else "",
    )
    yield Figure("the engine: speed / the other checkout", share_before * time_before / (own_share * own_time))
    yield Figure(
        "all else: speed / the other checkout", (1 - share_before) * time_before / ((1 - own_share) * own_time)
    )


def figures(label: str, run: FinishedRun, seconds: int, maximum: float) -> Iterator[Figure]:
    """Yield the figures of a run; its time is to be at most `maximum` times that of its engine."""
    rest = (run.wall - run.engine) / run.steps * 1e6
    yield Figure(f"{label}: run / engine", run.ratio, maximum=maximum, note=f"{rest:.1f} us/step beside the engine")
    yield Figure(f"{label}: speed", seconds / run.wall, "x real time", note=f"{run.wall:.1f} s")
