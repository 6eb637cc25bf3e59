"""One run: a trial, an agent that works it, and what came of it."""

from __future__ import annotations

import platform
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np

import cellwright
from cellwright.agents.agent import Agent
from cellwright.cell import Cell
from cellwright.client.client import Client
from cellwright.client.transports.in_process import InProcess
from cellwright.competition import is_done
from cellwright.errors import RunEndedError, SimulationError, UsageError
from cellwright.kitting.effects import Effect
from cellwright.kitting.evidence import Evidence
from cellwright.kitting.scorer import GameScore
from cellwright.recording.run_log import RunLog
from cellwright.simulation.clock import nanoseconds
from cellwright.simulation.pacing import Pacer
from cellwright.simulation.snapshot import read_checkpoint
from cellwright.simulation.watches import Watch

GRACE = 2.0
"""Simulation time [s] that an agent may go on after the competition is done, to see that it is."""

DRIVE = 30.0
"""Simulation time [s] for which a kit that is on its way is waited for after the agent has returned."""


class Outcome(StrEnum):
    """How a run ended."""

    DONE = "done"
    TIME_LIMIT = "time limit"
    GAVE_UP = "the agent ended before the orders were complete"
    CRASHED = "the agent crashed"
    UNSTABLE = "the simulation became unstable"
    UNTIL = "stopped before the competition was done"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class RunOptions:
    """What a run may be told besides its cell and its agent.

    Attributes:
        speed: simulated seconds a wall second; None: as fast as it goes.
        until: stop at this simulation time [s]; None: when the run is over.
        ends_when_done: whether the run is over soon after the competition is; else it goes on.
        listen: topics to listen to besides; "all" stands for every topic.
        at: actions at given simulation times [s], such as taking a picture.
        on_progress: called ten times a simulated second.
        checkpoints: files to save the simulation to, at given simulation times [s]; the times are part of the run.
        log: takes what happens, to keep it on disk as it grows.
        start: a checkpoint to begin from, instead of time 0. The agent begins anew all the same.
    """

    speed: float | None = None
    until: float | None = None
    ends_when_done: bool = True
    listen: Sequence[str] = ()
    at: Sequence[tuple[Fraction, Callable[[Cell], None]]] = ()
    on_progress: Callable[[Cell], None] | None = None
    checkpoints: Sequence[tuple[Fraction, Path]] = ()
    start: Path | None = None
    log: RunLog | None = None


@dataclass
class RunResult:
    """What came of a run. Times in seconds."""

    outcome: Outcome
    competition_state: str
    score: GameScore
    evidence: Evidence
    state_hash: str
    simulated: float
    wall: float
    steps: int
    error: str = ""
    heard: dict[str, int] = field(default_factory=dict)

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds a wall second."""
        return self.simulated / self.wall if self.wall > 0 else 0.0


class Course:
    """A run under way.

    Args:
        cell: what runs.
        transport: what lets its time pass, up to the deadline that it has.
        heard: how many messages were counted so far, by topic.
    """

    def __init__(self, cell: Cell, transport: InProcess, heard: Mapping[str, int]) -> None:
        self.cell = cell
        self.transport = transport
        self._heard = heard
        self._tick = cell.simulation.clock.tick
        self._wall = time.perf_counter()

    def result(self, outcome: Outcome, error: str = "") -> RunResult:
        """What has come of it by now."""
        cell, clock = self.cell, self.cell.simulation.clock
        return RunResult(
            outcome=outcome,
            competition_state=cell.competition.state,
            score=cell.competition.score(),
            evidence=cell.competition.evidence(),
            state_hash=cell.state_hash(),
            simulated=cell.simulation.time - self._tick * float(clock.timestep),
            wall=time.perf_counter() - self._wall,
            steps=clock.tick - self._tick,
            error=error,
            heard=dict(self._heard),
        )


Work: TypeAlias = Callable[[Course], tuple[Outcome, str]]
"""Lets time pass until a run is over; says how it ended, and what went wrong."""


def run_cell(cell: Cell, agent: Agent | None, options: RunOptions | None = None) -> RunResult:
    """Run a cell from the start until it is over; without an agent, until the time asked for.

    Raises:
        UsageError: neither an agent nor a time to stop at.
        UnknownNameError: a topic to listen to that does not exist.
        CheckpointError: the checkpoint to begin from cannot be read, or is of another cell.
    """
    options = options or RunOptions()
    if agent is None and options.until is None:
        raise UsageError("without an agent a run has no end: say until when")
    return conduct(cell, partial(_work, agent), options)


def conduct(cell: Cell, work: Work, options: RunOptions) -> RunResult:
    """Run a cell from the start, with `work` to let its time pass.

    Raises:
        UnknownNameError: a topic to listen to that does not exist.
        CheckpointError: the checkpoint to begin from cannot be read, or is of another cell.
    """
    with ExitStack() as leaving:  # the cell is left as it was found, for other runs to come
        return _conduct(cell, work, options, leaving)


def _conduct(cell: Cell, work: Work, options: RunOptions, leaving: ExitStack) -> RunResult:
    for when, path in options.checkpoints:
        cell.checkpoints.declare(nanoseconds(when), path)
        leaving.callback(cell.checkpoints.withdraw, nanoseconds(when))
    cell.reset()
    if options.start is not None:
        read_checkpoint(cell.simulation, options.start)
    transport = InProcess(cell, node="/agent")
    if options.speed is not None:
        transport.step = Pacer(cell.simulation, options.speed).step
    if options.until is not None:
        transport.deadline = nanoseconds(options.until)

    def watch_for_the_end(effect: Effect) -> None:
        if is_done(effect) and options.ends_when_done:
            _end_soon(transport)

    heard = _listen(cell, options.listen, leaving)
    _plan(cell, options, leaving)
    cell.competition.on_effect.append(watch_for_the_end)
    leaving.callback(cell.competition.on_effect.remove, watch_for_the_end)
    if options.log is not None:
        _keep_log(cell, options.log, leaving)
    if cell.competition.state == "done" and options.ends_when_done:  # it was so in the checkpoint
        _end_soon(transport)
    course = Course(cell, transport, heard)
    outcome, error = work(course)
    cell.bus.refusals.flush()
    result = course.result(outcome, error)
    if options.log is not None:
        more = {"competition_state": result.competition_state, "state_hash": result.state_hash, "error": result.error}
        counts = {"simulated": result.simulated, "wall": result.wall, "steps": result.steps}
        options.log.end(outcome.name.lower(), result.evidence, cell.simulation.now, more | counts)
    return result


def _keep_log(cell: Cell, log: RunLog, leaving: ExitStack) -> None:
    def keep(effect: Effect) -> None:
        log.effect(effect, cell.simulation.now)

    timestep = float(cell.simulation.clock.timestep)
    about = {"seed": cell.seed, "servo": cell.servo, "timestep": timestep, "time": cell.simulation.time}
    log.begin(cell.trial, about | {"versions": versions()})
    cell.competition.on_effect.append(keep)
    leaving.callback(cell.competition.on_effect.remove, keep)


def _work(agent: Agent | None, course: Course) -> tuple[Outcome, str]:
    cell, transport = course.cell, course.transport
    client = Client(transport)
    try:
        if agent is None:
            client.wait_until(lambda: False)
        else:
            let_work(agent, client)
            wait_for_kits(cell, client)
    except RunEndedError:
        pass  # the ordinary end of a program that works until it is stopped
    except KeyboardInterrupt:
        return Outcome.INTERRUPTED, ""
    except SystemExit as stop:
        return Outcome.CRASHED, told(stop)
    except SimulationError as error:
        return Outcome.UNSTABLE, f"{error}\n"
    except Exception as raised:  # whatever somebody's program raises is reported, and the run still has its score
        return Outcome.CRASHED, told(raised)
    finally:
        client.close()
    stopped = cell.simulation.now >= transport.deadline
    return how_it_ended(cell, otherwise=Outcome.UNTIL if stopped else Outcome.GAVE_UP), ""


def how_it_ended(cell: Cell, *, otherwise: Outcome) -> Outcome:
    """How a run ended that came to its end: by the competition, or otherwise."""
    if cell.competition.state != "done":
        return otherwise
    return Outcome.TIME_LIMIT if cell.competition.is_timed_out else Outcome.DONE


def let_work(agent: Agent, client: Client) -> None:
    """Let an agent work. A program may end itself, and says with its status whether it came to its end."""
    try:
        agent.run(client)
    except SystemExit as stop:
        if stop.code not in (None, 0):
            raise


def told(error: Exception | SystemExit, *files: str) -> str:
    """The error and how the agent came to it; frames of this file and of `files` are of no interest to its author."""
    if isinstance(error, SystemExit):
        return f"the agent exited with {error.code!r}\n"
    inner = error.__traceback__
    while inner is not None and inner.tb_frame.f_code.co_filename in (__file__, *files):
        inner = inner.tb_next
    return "".join(traceback.format_exception(type(error), error, inner or error.__traceback__))


def wait_for_kits(cell: Cell, client: Client) -> None:
    """The agent has returned; kits that it sent off still arrive, and the competition may still end."""
    competition, agvs = cell.competition, tuple(cell.agvs.values())

    def nothing_to_come() -> bool:
        return competition.state == "done" or all(agv.state != "preparing_to_deliver" for agv in agvs)

    client.wait_until(nothing_to_come, DRIVE)
    client.wait_until(lambda: competition.state == "done", 0.1)


def _end_soon(transport: InProcess) -> None:
    transport.deadline = min(transport.deadline, transport.now() + nanoseconds(GRACE))
    transport.reason = "the competition is done"


def _listen(cell: Cell, topics: Sequence[str], leaving: ExitStack) -> Counter[str]:
    heard: Counter[str] = Counter()
    names = [name for topic in topics for name in (cell.topics() if topic == "all" else [topic])]
    for name in names:
        cell.bus.topic(name)
        subscription = cell.bus.subscribe(name, partial(_count, heard, name), node="/listener")
        leaving.callback(subscription.cancel)
    return heard


def _count(heard: Counter[str], name: str, _message: object) -> None:
    heard[name] += 1


def _plan(cell: Cell, options: RunOptions, leaving: ExitStack) -> None:
    for when, action in options.at:
        if nanoseconds(when) <= cell.simulation.now:
            action(cell)
        else:
            leaving.callback(_once(cell, when, action).cancel)
    if options.on_progress is not None:
        report = options.on_progress
        watch = cell.simulation.watch("progress", Fraction(1, 10), lambda _: report(cell))
        leaving.callback(watch.cancel)


def _once(cell: Cell, when: Fraction, action: Callable[[Cell], None]) -> Watch:
    def look(_: int) -> None:
        watch.cancel()
        action(cell)

    watch = cell.simulation.watch("once", when, look)
    return watch


def versions() -> dict[str, str]:
    """What a result depends on besides trial, agent and seed."""
    return {
        "cellwright": cellwright.__version__,
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
    }
