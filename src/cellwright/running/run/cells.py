"""Session target that runs a cell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, replace
from fractions import Fraction
from functools import cached_property, partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cellwright.cell.cell import Cell
from cellwright.cell.competition import is_done
from cellwright.cell.controllers import HARDWARE, ControlledArm, ControllerManager
from cellwright.cell.interface.rows import CONTROLLER_NAMES
from cellwright.cell.kitting.effects import Effect
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.robots import CellRobot
from cellwright.config.parsing.sources import Sources
from cellwright.config.robot.model import JointType
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import NEVER, nanoseconds, seconds
from cellwright.engine.snapshot import read_checkpoint
from cellwright.recording.format.run_log import RunEvents
from cellwright.rendering.views import OVERVIEW, camera_of
from cellwright.running.run.collisions import Collision, CollisionWatch
from cellwright.running.run.options import GRACE, RunOptions
from cellwright.running.run.result import Outcome, RunResult, SessionResult, cell_result, final_outcome, versions
from cellwright.running.run.target import Origin, RunControls, Served, Target, common_facts, subscribe
from cellwright.viewer.services.cell_panel import IN_COMPETITION, OVER, CellPanel

if TYPE_CHECKING:
    from cellwright.middleware.ros1.identity import Identity
    from cellwright.recording.format.format import RecordingHeader
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.viewer.filming import VideoRecorder
    from cellwright.viewer.services.control import Control


class CellTarget(Target):
    """A cell, run from the start.

    Args:
        make: returns the cell when the session opens: a new one, or an existing one.
        files: returns the files of its trial, as they were named.
        about: further facts about the run for a panel, such as the agent's name.
        is_varied: True if the seed varied the trial after it was read.
        sources: the files that the trial was read from, if that was before the session opens.
    """

    acts, stopped = "drive the cell", "the cell has stopped"
    controller_names: Mapping[str, str] = MappingProxyType(CONTROLLER_NAMES)
    identity: Identity | None = None
    node: Cell

    def __init__(
        self,
        make: Callable[[], Cell],
        files: Callable[[], list[Path]] = list,
        *,
        about: Mapping[str, Any] | None = None,
        is_varied: bool = False,
        sources: Sources | None = None,
    ) -> None:
        self._make, self._named_files, self._about = make, files, about
        self._is_varied, self._sources = is_varied, sources
        self._options = RunOptions()  # of the present run
        self._heard: Counter[str] = Counter()
        self._next: dict[str, Any] = {}  # seed, variation and joints of the next run, if they change
        self._collisions: CollisionWatch | None = None
        self._control: Control | None = None
        self._on_collision: list[Callable[[Collision], None]] = []

    def open(self, controls: RunControls) -> None:
        """Make the cell."""
        self.node, self._stop = self._make(), controls.stop

    def close(self) -> None:
        """Release the render process; the next picture of an existing cell starts another one."""
        self.node.render_service.close()

    def offer(self, served: Served) -> None:
        """Offer the services for viewers, and those of a controller manager if there is an arm."""
        from cellwright.viewer.services.entity_services import EntityServices

        cell = self.node
        self._control = served.offer_simulation(
            self,
            cell,
            restart_refusal=lambda: IN_COMPETITION if cell.in_competition else "",
            refused={},
            entities=EntityServices(cell),
        )
        if cell.arms:
            rate = round(1 / cell.simulation.clock.timestep)
            arms = {
                each.namespace or HARDWARE: ControlledArm(cell.arms[each.name].joints, partial(self._controller, each))
                for each in cell.trial.arms
            }
            manager = ControllerManager(rate, arms)
            for name, handler in manager.services.items():
                served.server.offer(name, handler)

    def begin(self, options: RunOptions, run: ExitStack) -> None:
        """Start a run at time 0, or at a checkpoint.

        Raises:
            UnknownNameError: a topic to listen to does not exist.
            CheckpointError: the checkpoint cannot be read, or is of another cell.
        """
        cell, self._options = self.node, options
        for when, path in options.checkpoints:
            cell.checkpoints.declare(nanoseconds(when), path)
            run.callback(cell.checkpoints.withdraw, nanoseconds(when))
        self.reset()
        if options.start is not None:
            read_checkpoint(cell.simulation, options.start)
        self._listen(options, run)
        for when, action in options.at:
            at(cell, when, action, run)
        if options.on_progress is not None:
            on_progress = options.on_progress
            run.callback(cell.simulation.watch("progress", Fraction(1, 10), lambda _: on_progress(cell)).cancel)
        if options.ends_when_done:
            self._watch_for_the_end(run)
        if cell.task is not None:
            ends = partial(self._stop_now, "the task has succeeded") if options.ends_when_done else _go_on
            run.callback(cell.task.watch(ends).cancel)
        self._cell_panel.restart()
        if self._control is not None:
            self._control.over = ""
        self._collisions = None
        if cell.arms or cell.robots:
            self._collisions = CollisionWatch(cell, self._keep_collision)
            run.callback(self._collisions.end)
            subscribe(cell.simulation.on_rewind, self._collisions.rewind, run)

    def _keep_collision(self, collision: Collision) -> None:
        for keep in self._on_collision:
            keep(collision)

    def _watch_for_the_end(self, run: ExitStack) -> None:
        cell = self.node

        def end_soon() -> None:
            self._stop.limit(cell.simulation.now + nanoseconds(GRACE), "the competition is done")

        def watch(effect: Effect) -> None:
            if is_done(effect):
                end_soon()

        subscribe(cell.competition.on_effect, watch, run)
        if cell.competition.state == "done":  # the checkpoint was in this state
            end_soon()

    def _stop_now(self, reason: str) -> None:
        self._stop.limit(self.node.simulation.now, reason)

    def _listen(self, options: RunOptions, run: ExitStack) -> None:
        cell, heard = self.node, Counter[str]()
        for name in (name for topic in options.listen for name in (cell.topics() if topic == "all" else [topic])):
            cell.bus.topic(name)
            run.callback(cell.bus.subscribe(name, partial(_count, heard, name), node="/listener").cancel)
        self._heard = heard

    def start_next_with(self, start: Mapping[str, Any]) -> None:
        """Begin the next run with this seed, variation and joints.

        Raises:
            UsageError: one is out of range; nothing is changed.
        """
        self.node.check_start(**start)
        self._next = dict(start)

    def reset(self, *, keeps_clock: bool = False) -> None:
        """Start again at time 0; with `keeps_clock`, message time goes on."""
        start, self._next = self._next, {}
        self.node.reset(keeps_clock=keeps_clock, **start)
        if self._collisions is not None:
            self._collisions.reset()

    def outcome_by_now(self) -> Outcome:
        """Return the outcome of a run that is stopped now."""
        return final_outcome(self.node, otherwise=Outcome.UNTIL)

    def latest_end(self) -> int:
        """Return the simulation time [ns] of the trial's limit; `NEVER` if it has none."""
        limit = self.node.trial.time_limit
        return NEVER if limit is None else nanoseconds(limit)

    def judged(self, measured: SessionResult) -> RunResult:
        """Return the result of the run so far: its figures, and the score."""
        competition, task = self.node.competition, self.node.task
        succeeded_at = None if task is None or task.succeeded_at is None else seconds(task.succeeded_at)
        return RunResult(
            **{**vars(measured), "outcome": Outcome(measured.outcome)},
            competition_state=competition.state,
            score=competition.score(),
            evidence=competition.evidence(),
            heard=dict(self._heard),
            success=None if task is None else succeeded_at is not None,
            succeeded_at=succeeded_at,
        )

    def end(self, result: SessionResult, *, restarts: bool) -> RunResult:
        """End the run: no more collisions; panels show the result."""
        ended = cell_result(result)
        self.node.bus.refusals.flush()
        if self._collisions is not None:
            collisions = tuple(self._collisions.end())
            ended = replace(ended, collisions=collisions, nearest_arms=self._collisions.nearest)
        if not restarts:
            self._cell_panel.end({"outcome": ended.word} | ended.facts("error", "state_hash", "simulated", "wall"))
            if self._control is not None:
                self._control.over = OVER
        return ended

    @cached_property
    def _cell_panel(self) -> CellPanel:
        """Panel of the cell; created at its first use."""
        panel = CellPanel(self.node, self._about)
        panel.collisions = lambda: None if self._collisions is None else self._collisions.panel()
        return panel

    def panel(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""
        return self._cell_panel.panel()

    def _controller(self, arm: Arm) -> Mapping[str, Any]:
        """Return the parameters of an arm's controller in ROS 1."""
        cell = self.ros_parameters()["ariac"]
        found: Mapping[str, Any] = (cell[arm.namespace] if arm.namespace else cell)["arm"]
        return found

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters for the parameter server of ROS 1."""
        from cellwright.cell.interface.parameters import parameters

        return dict(parameters(self.node.trial, competition=self.node.in_competition))

    def film(self, options: VideoOptions, *, waits: bool, report: Callable[[str], None]) -> VideoRecorder:
        """Return a video of the cell, with time, points and the agent's activity in a corner."""
        from cellwright.viewer.filming import VideoRecorder  # slow to load

        cell = self.node

        def caption() -> str:
            points = cell.competition.score().total
            words = (f"{cell.simulation.time:.1f} s", f"{points:g} {'point' if points == 1 else 'points'}")
            return "   ".join(word for word in (*words, cell.intention.text) if word)

        camera = camera_of(options.camera or OVERVIEW, cell.views)
        return VideoRecorder(cell, options, camera=camera, caption=caption, waits=waits, warn=report)

    @contextmanager
    def events(self, events: RunEvents, more: Mapping[str, Any]) -> Iterator[Callable[[], None]]:
        """Report the events of a run to a log; the result starts it, as after a reset."""
        cell = self.node

        def begin() -> None:
            timestep = float(cell.simulation.clock.timestep)
            about = {"seed": cell.seed, "servo": cell.servo, "timestep": timestep, **more}
            events.begin(cell.trial, about | {"versions": versions()})

        with ExitStack() as leaving:
            begin()
            subscribe(cell.competition.on_effect, lambda effect: events.effect(effect, cell.simulation.now), leaving)
            subscribe(self._on_collision, lambda collision: events.collision(asdict(collision)), leaving)
            yield begin

    def origin(self, collected: Sources) -> Origin:
        """Return the files of the trial."""
        return Origin(collected if self._sources is None else self._sources, self._named_files())

    def stamp(self) -> None:
        """Return None: commands arrive at simulation time alone."""

    def header(self, about: Mapping[str, Any], origin: Origin) -> RecordingHeader:
        """Return the header of a recording: the facts that the run depends on, besides external input."""
        from cellwright.recording.format.format import RecordingHeader

        cell, timestep = self.node, self.node.simulation.clock.timestep
        facts = {
            **common_facts(about),
            "seed": cell.seed,
            "servo": cell.servo,
            "competition": cell.in_competition,
            "timestep": [timestep.numerator, timestep.denominator],
            "circumstances": asdict(cell.trial.circumstances),
            "overrides": list(cell.trial.overrides),
            "varied": self._is_varied or cell.start.bounds is not None,
            "bounds": None if cell.start.bounds is None else asdict(cell.start.bounds),
            "joints": dict(cell.start.joints),
            "arms": {arm.name: {"namespace": arm.namespace, "tool": arm.holder} for arm in cell.trial.arms},
            "robots": {robot.name: _about(robot, cell.trial) for robot in cell.trial.layout.robots},
            "checkpoints": sorted(nanoseconds(when) for when, _ in self._options.checkpoints),
            **origin.facts(),
        }
        return RecordingHeader("cell", cell.name, facts)

    def recorded_panel(self, about: Mapping[str, Any]) -> dict[str, Any]:
        """Return the panel content for a recording."""
        panel = self.panel({})
        return panel | {"about": {**panel["about"], **about}}


def at(cell: Cell, when: Fraction, action: Callable[[Cell], None], run: ExitStack) -> None:
    """Call an action once at a simulation time [s]; at once if that time has passed."""
    if nanoseconds(when) <= cell.simulation.now:
        action(cell)
        return

    def act(_: int) -> None:
        watch.cancel()
        action(cell)

    watch = cell.simulation.watch("once", when, act)
    run.callback(watch.cancel)


def _about(robot: CellRobot, trial: Trial) -> dict[str, Any]:
    """Return what a recording says of a robot: namespace of its topics, and which of its joints slide."""
    driven = trial.robot_models[robot.name].robot.driven
    sliding = [joint.name for joint in driven if joint.type is JointType.PRISMATIC]
    return {"namespace": robot.namespace, "sliding": sliding}


def _go_on() -> None:
    """Do nothing at a success: the run ends by other means."""


def _count(heard: Counter[str], name: str, _message: object) -> None:
    heard[name] += 1
