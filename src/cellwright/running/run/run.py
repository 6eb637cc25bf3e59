"""Run of a cell from start to result, and its options."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cellwright.cell.cell import Cell
from cellwright.cell.competition import is_done
from cellwright.cell.kitting.effects import Effect
from cellwright.clients.agents.agent import Agent
from cellwright.clients.client.in_process import InProcess
from cellwright.engine.clock import nanoseconds
from cellwright.engine.events import Watch
from cellwright.engine.loop import StopCondition
from cellwright.engine.rate_control import RealTimePacer
from cellwright.engine.snapshot import read_checkpoint
from cellwright.recording.format.run_log import RunLog
from cellwright.running.run.record import CellRecording, RecordOptions, record_while
from cellwright.running.run.result import Collision, CollisionWatch, RunResult, versions
from cellwright.running.run.work import RunContext, Work, work_in_process
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from cellwright.viewer.services.cell_panel import CellPanel


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
        record: how the run is recorded, if it is.
        panel: shows the run; it gets the collisions of the arm.
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
    panel: CellPanel | None = None
    log: RunLog | None = None
    record: RecordOptions | None = None


GRACE = 2.0
"""Simulation time [s] that an agent may go on after the competition is done, to see that it is."""


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
    return execute_run(cell, partial(work_in_process, agent), options)


def execute_run(cell: Cell, work: Work, options: RunOptions) -> RunResult:
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
    stop = StopCondition(None if options.until is None else nanoseconds(options.until))
    transport = InProcess(cell, node="/agent", stop=stop)
    if options.speed is not None:
        transport.step = RealTimePacer(cell.simulation, options.speed).step

    def watch_for_the_end(effect: Effect) -> None:
        if is_done(effect) and options.ends_when_done:
            _end_soon(cell, stop)

    heard = _listen(cell, options.listen, leaving)
    _plan(cell, options, leaving)
    cell.competition.on_effect.append(watch_for_the_end)
    leaving.callback(cell.competition.on_effect.remove, watch_for_the_end)
    course = RunContext(cell, transport, heard)
    if options.log is not None:
        _keep_log(course, options.log, leaving)
    if cell.competition.state == "done" and options.ends_when_done:  # it was so in the checkpoint
        _end_soon(cell, stop)
    recording = None if options.record is None else record_while(cell, options.record, options, leaving)
    collisions = _watch_collisions(course, options, recording, leaving)
    outcome, error = work(course)
    cell.bus.refusals.flush()
    found = [] if collisions is None else collisions.end()
    result = course.result(outcome, error)
    result.collisions = found
    if options.log is not None:
        more = {"competition_state": result.competition_state, "state_hash": result.state_hash, "error": result.error}
        counts = {"simulated": result.simulated, "wall": result.wall, "steps": result.steps}
        options.log.end(outcome.name.lower(), result.evidence, cell.simulation.now, more | counts)
    if recording is not None:
        recording.end(result)
        result.recordings, result.is_recorded = recording.files, recording.is_whole
    return result


def _keep_log(course: RunContext, log: RunLog, leaving: ExitStack) -> None:
    cell = course.cell

    def keep(effect: Effect) -> None:
        log.effect(effect, cell.simulation.now)

    timestep = float(cell.simulation.clock.timestep)
    about = {"seed": cell.seed, "servo": cell.servo, "timestep": timestep, "time": cell.simulation.time}
    log.begin(cell.trial, about | {"versions": versions()})
    cell.competition.on_effect.append(keep)
    leaving.callback(cell.competition.on_effect.remove, keep)
    course.on_reset.append(log.reset)


def _watch_collisions(
    course: RunContext, options: RunOptions, recording: CellRecording | None, leaving: ExitStack
) -> CollisionWatch | None:
    if course.cell.arm is None:
        return None

    def keep(collision: Collision) -> None:
        if options.log is not None:
            options.log.collision(asdict(collision))
        if recording is not None:
            recording.collision(collision)

    watch = CollisionWatch(course.cell, keep)
    for panel in (options.panel, None if recording is None else recording.panel):
        if panel is not None:
            panel.collisions = watch.panel
    leaving.callback(watch.end)
    course.on_reset.append(watch.reset)
    return watch


def _end_soon(cell: Cell, stop: StopCondition) -> None:
    stop.limit(cell.simulation.now + nanoseconds(GRACE), "the competition is done")


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
