"""Targets of a session: a cell here, a robot in `robots`, a recording in `playback`; and the lookup of names."""

from __future__ import annotations

import time
import warnings
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import asdict, replace
from datetime import UTC, datetime
from fractions import Fraction
from functools import cached_property, partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cellwright.cell.cell import Cell
from cellwright.cell.competition import is_done
from cellwright.cell.controllers import ControllerManager
from cellwright.cell.interface.rows import CONTROLLER_NAMES
from cellwright.cell.kitting.effects import Effect
from cellwright.config.parsing.overrides import Override
from cellwright.config.parsing.sources import sources_collected
from cellwright.config.robot import robots
from cellwright.config.robot.config import RobotConfig
from cellwright.config.trial import gear2017
from cellwright.config.trial.joining import TrialName, find_files
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import nanoseconds
from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.engine.rate_control import RateControl
from cellwright.engine.snapshot import read_checkpoint
from cellwright.recording.format.run_log import RunEvents
from cellwright.rendering.camera import VIEWS
from cellwright.running.run.options import GRACE, RecordOptions, RunOptions
from cellwright.running.run.result import (
    Collision,
    CollisionWatch,
    Outcome,
    RunResult,
    SessionResult,
    final_outcome,
    versions,
)
from cellwright.util.errors import SimulationError, UsageError
from cellwright.viewer.services.cell_panel import IN_COMPETITION, OVER, CellPanel

if TYPE_CHECKING:
    from cellwright.middleware.ros1.host.ros1 import Identity
    from cellwright.middleware.server import Server
    from cellwright.recording.format.format import RecordingHeader
    from cellwright.recording.format.recorder import Recorder
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.viewer.filming import VideoRecorder
    from cellwright.viewer.services.control import Control
    from cellwright.viewer.services.entity_services import EntityServices


class DescriptionWarning(UserWarning):
    """A warning for a file's author that stops nothing, as `path:line: key: message`."""


def load_trial(*sources: TrialName, text: str | None = None, overrides: Sequence[str] = ()) -> Trial:
    """Load a trial by its name or its files, or from a text. Notes for its author come as `DescriptionWarning`.

    Example:
        >>> import cellwright
        >>> cellwright.load_trial("lesson").name
        'lesson'
        >>> cellwright.load_trial("final01+kitter_sensors").has_arm
        True
        >>> cellwright.load_trial(text="time_limit: 60").time_limit
        60.0
        >>> cellwright.load_trial("lesson", overrides=["time_limit=60"]).time_limit
        60.0

    Args:
        sources: a bundled trial (`"lesson"`) or the path of a YAML file; several are joined, as are those of one name
            with `+` (`"final01+kitter_sensors"`) and of a list.
        text: the configuration itself, instead.
        overrides: values that replace those of the files, as `KEY=VALUE`: the key as errors and warnings print it, and
            the value as YAML.

    Raises:
        UnknownNameError: there is no such trial or file.
        DescriptionError: the configuration is not valid, or the trial would ignore an override; the error lists
            everything that is wrong.
        UsageError: there is neither a name nor a text, or both; or an override is not KEY=VALUE.
    """
    loaded = gear2017.load_trial(
        [file for source in sources for file in find_files(source)],
        text=text,
        overrides=list(map(Override.read, overrides)),
    )
    warn_of(loaded.warnings, 3)
    return loaded.trial


def load_robot(name_or_path: str | Path, *, xacro_arguments: Mapping[str, str] | None = None) -> RobotConfig:
    """Load a robot by its name or its file. Notes for the file's author come as `DescriptionWarning`.

    Example:
        >>> import cellwright
        >>> cellwright.load_robot("tandem").name
        'tandem'

    Args:
        name_or_path: a bundled robot (`"tandem"`), a `vr_configs.yml`, a folder with one, or a URDF or xacro.
        xacro_arguments: arguments of the xacro file, by name; they replace those of a configuration.

    Raises:
        UnknownNameError: there is no robot of this name.
        DescriptionError: the files are not valid; the error lists everything that is wrong.
    """
    lines: list[str] = []
    config = robots.load_robot(name_or_path, lines.append, xacro_arguments or {})
    warn_of(lines, 3)
    return config


def warn_of(lines: Iterable[object], level: int) -> None:
    """Issue the lines as warnings of the caller `level` calls up."""
    for line in lines:
        warnings.warn(str(line), DescriptionWarning, stacklevel=level)


class SessionState(ABC):
    """State of a session for its target and its observers; `Session` documents each attribute."""

    target: Target
    options: RunOptions
    rate: RateControl
    stop: StopCondition
    loop: SimulationLoop
    lockstep: bool
    about: dict[str, Any]
    record: RecordOptions | None
    video: VideoOptions | None
    log: Path | None
    report: Callable[[str], None]
    notice: Callable[[str], None]
    on_reset: list[Callable[[int], object]]
    """Called with the old time [ns] when a run has started again under way."""
    node: Any = None
    server: Server | None = None
    result: SessionResult | None = None
    number = 0
    load_world: Callable[[Trial], None] | None = None
    """Ends the session soon, and starts another one with a trial; None if that is not possible."""
    restart_refusal = ""
    """Reason why a run may not start again, besides those of its target."""
    restart_requested = False
    """True if a restart was requested, so that the run is run once more."""
    _first_tick = 0
    _begun = 0.0  # [s] of `time.perf_counter`

    @abstractmethod
    def reset(self, *, keeps_clock: bool = False) -> None:
        """Restart the run while clients stay connected; an agent in this process is run again."""

    @abstractmethod
    def state_refusal(self) -> str:
        """Return why the run may not start again while the clock goes on; empty if it may."""

    def measured(self) -> dict[str, Any]:
        """Return the common figures of the run so far, as keyword arguments of `SessionResult`."""
        simulation = self.node.simulation
        return {
            "simulated": simulation.time - self._first_tick * float(simulation.clock.timestep),
            "wall": time.perf_counter() - self._begun,
            "steps": simulation.clock.tick - self._first_tick,
            "state_hash": simulation.state_hash(),
            "pace": self.loop.pace,
        }

    def numbered_file(self, file: Path) -> Path:
        """Return the file of this name for the newest run: run.mp4, run_2.mp4."""
        return file if self.number == 1 else file.with_stem(f"{file.stem}_{self.number}")


class Target(ABC):
    """Target of a session: a node whose time passes, and the particulars of its kind.

    Args:
        make: returns the node when the session opens: a new one, or an existing one.
    """

    acts = ""
    """Verb phrase for what clients can do, for a warning."""
    stopped = ""
    """Reason for the end of the server if no other is known."""
    has_end = False
    """True if the target has an end of its own."""
    can_wait = True
    """True if time may wait for slow clients."""
    runs_from_start = False
    """True if a run starts at time 0, and has a result that a page shows before the server closes."""
    identity: Identity | None = None
    """Its node in ROS 1; None: the simulator of 2017."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make = make
        self.node: Any = None
        self.control: Control | None = None
        """Control of time for viewers; None if there is none."""

    def open(self, session: SessionState) -> None:
        """Create the node; if it is to be recorded, the files that are read for it are kept."""
        record = session.record
        if record is None or record.sources is not None:
            self.node = self._make()
            return
        with sources_collected() as sources:
            self.node = self._make()
            files = record.files or self.named_files()
        session.record = replace(record, sources=sources, files=files)

    def named_files(self) -> list[Path]:
        """Files that were named to read it."""
        return []

    def close(self) -> None:  # noqa: B027
        """Release the node."""

    def begin(self, session: SessionState, run: ExitStack) -> None:  # noqa: B027
        """Start a run; `run` restores the state before it."""

    def check_start(self, start: Mapping[str, Any]) -> None:
        """Check the seed, the variation and the joints for the next run, before anything is changed.

        Raises:
            UsageError: the target has none, or one is out of range.
        """
        if start:
            raise UsageError(f"reset: {', '.join(start)}: only a cell starts with them; leave them out")

    def start_next_with(self, start: Mapping[str, Any]) -> None:  # noqa: B027
        """Begin the next run with a checked seed, variation and joints."""

    @abstractmethod
    def reset(self, *, keeps_clock: bool = False) -> None:
        """Start again while clients stay connected; see `Simulation.reset` for `keeps_clock`."""

    def loop(self, session: SessionState) -> tuple[str, str]:
        """Let time pass until the run stops; return how it ended, and the error."""
        try:
            self.pass_time(session.loop)
        except SimulationError as error:
            return "unstable", str(error)
        except KeyboardInterrupt:
            return "stopped", ""
        return "stopped" if session.stop.is_requested else "until", ""

    def pass_time(self, loop: SimulationLoop) -> None:
        """Let time pass until the loop stops."""
        loop.run()

    def result(self, session: SessionState, outcome: str, error: str) -> SessionResult:
        """Return the result of the run so far."""
        return SessionResult(outcome=outcome, error=error, **session.measured())

    def outcome_by_now(self) -> str:
        """Return the outcome of a run that is stopped now."""
        return "stopped"

    def ready_note(self) -> str:
        """Note for the user when the target is ready."""
        return ""

    def end(self, session: SessionState, result: SessionResult) -> None:  # noqa: B027
        """End the run; its clients are still connected."""

    def restart_refusal(self) -> str:
        """Return why the run may not start again; empty if it may."""
        return ""

    def refused(self) -> dict[str, str]:
        """Refused actions on its time, with the reasons."""
        return {}

    @abstractmethod
    def panel(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""

    def offer(self, session: SessionState) -> None:
        """Offer the services of a server for pages and other viewers."""
        from cellwright.viewer.services.control import Control, Reset
        from cellwright.viewer.services.scene import offer_viewer_services
        from cellwright.viewer.services.simulation import SimulationServices

        assert session.server is not None
        self.control = Control(
            session.rate,
            reset=Reset(
                session.reset,
                lambda: self.restart_refusal() or session.restart_refusal,
                partial(session.reset, keeps_clock=True),
                session.state_refusal,
            ),
            refused=self.refused(),
            lockstep=session.lockstep,
        )
        offer_viewer_services(session.server, self.node, self.panel, self.control)
        session.server.offer("cellwright/parameters", lambda _request: self.ros_parameters())
        SimulationServices(
            self.node,
            self.control,
            stop=session.stop,
            entities=self.entity_services(),
            load=session.load_world,
            has_clock=self.identity is None or self.identity.tells_time,
        ).offer(session.server)

    def entity_services(self) -> EntityServices | None:
        """Return the services of its entities; None if it has none."""
        return None

    controller_names: Mapping[str, str] = MappingProxyType({})
    """Names that ros2_control has for topics and services, by their own."""

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters of its node: for the parameter server of ROS 1, and of the node in ROS 2."""
        return {}

    @abstractmethod
    def film(self, options: VideoOptions, *, waits: bool, report: Callable[[str], None]) -> VideoRecorder:
        """Return a video of it, not started.

        Raises:
            RenderingError: the file cannot be written.
            UsageError: it cannot be filmed, as a recording.
        """

    @abstractmethod
    def header(self, session: SessionState, record: RecordOptions) -> RecordingHeader:
        """Return the header of a recording.

        Raises:
            UsageError: it cannot be recorded, as a recording.
        """

    def recorded_panel(self, _record: RecordOptions) -> dict[str, Any]:
        """Return the panel content for a recording."""
        return self.panel({})

    stamp: Callable[[], int] | None = None
    """Source of a second time stamp for commands."""

    def recorded_events(
        self, _session: SessionState, _recorder: Recorder, _record: RecordOptions
    ) -> AbstractContextManager[None]:
        """Record further events."""
        return nullcontext()

    def recorded_end(self, result: SessionResult) -> dict[str, Any]:
        """Return the result for a recording."""
        return {"outcome": result.outcome, "error": result.error, "wall": result.wall}


def common_facts(record: RecordOptions) -> dict[str, Any]:
    """Return the facts of every recording as JSON values."""
    return {"versions": versions(), "recorded": datetime.now(UTC).isoformat(timespec="seconds"), **record.about}


def source_facts(record: RecordOptions) -> dict[str, Any]:
    """Return which files in a recording were named, in their order, and which are folders of ROS packages."""
    sources = record.sources
    if sources is None:
        return {"files": [], "packages": []}
    return {"files": [sources.name(path) for path in record.files], "packages": sources.packages()}


class CellTarget(Target):
    """A cell, run from the start.

    Args:
        files: returns the files of its trial, as they were named.
        about: further facts about the run for a panel, such as the agent's name.
    """

    acts, stopped, runs_from_start = "drive the cell", "the cell has stopped", True
    controller_names = MappingProxyType(CONTROLLER_NAMES)
    node: Cell

    def __init__(
        self, make: Callable[[], Cell], files: Callable[[], list[Path]] = list, about: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(make)
        self._about = about
        self._named_files = files
        self._heard: Counter[str] = Counter()
        self._next: dict[str, Any] = {}  # seed, variation and joints of the next run, if they change
        self._collisions: CollisionWatch | None = None
        self.on_collision: list[Callable[[Collision], None]] = []
        """Called with each collision of the arm that is over."""

    def offer(self, session: SessionState) -> None:
        """Offer the services for viewers, and those of a controller manager if there is an arm."""
        super().offer(session)
        assert session.server is not None
        if self.node.arm is not None:
            rate = round(1 / self.node.simulation.clock.timestep)
            manager = ControllerManager(rate, lambda: self.ros_parameters()["ariac"]["arm"])
            for name, handler in manager.services.items():
                session.server.offer(name, handler)

    def entity_services(self) -> EntityServices:
        """Return the services of the cell's entities."""
        from cellwright.viewer.services.entity_services import EntityServices

        return EntityServices(self.node)

    def named_files(self) -> list[Path]:
        """Files of the trial."""
        return self._named_files()

    def restart_refusal(self) -> str:
        """Return why the run may not start again: a competition goes on."""
        return IN_COMPETITION if self.node.in_competition else ""

    def begin(self, session: SessionState, run: ExitStack) -> None:
        """Start a run at time 0, or at a checkpoint.

        Raises:
            UnknownNameError: a topic to listen to does not exist.
            CheckpointError: the checkpoint cannot be read, or is of another cell.
        """
        cell, options = self.node, session.options
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
            self._watch_for_the_end(session, run)
        self.cell_panel.restart()
        if self.control is not None:
            self.control.over = ""
        self._collisions = None
        if cell.arm is not None:
            self._collisions = CollisionWatch(cell, self._keep_collision)
            run.callback(self._collisions.end)
            subscribe(session.on_reset, self._collisions.reset, run)
            subscribe(cell.simulation.on_rewind, self._collisions.rewind, run)

    def _keep_collision(self, collision: Collision) -> None:
        for keep in self.on_collision:
            keep(collision)

    def _watch_for_the_end(self, session: SessionState, run: ExitStack) -> None:
        cell = self.node

        def end_soon() -> None:
            session.stop.limit(cell.simulation.now + nanoseconds(GRACE), "the competition is done")

        def watch(effect: Effect) -> None:
            if is_done(effect):
                end_soon()

        subscribe(cell.competition.on_effect, watch, run)
        if cell.competition.state == "done":  # the checkpoint was in this state
            end_soon()

    def _listen(self, options: RunOptions, run: ExitStack) -> None:
        cell, heard = self.node, Counter[str]()
        for name in (name for topic in options.listen for name in (cell.topics() if topic == "all" else [topic])):
            cell.bus.topic(name)
            run.callback(cell.bus.subscribe(name, partial(_count, heard, name), node="/listener").cancel)
        self._heard = heard

    def check_start(self, start: Mapping[str, Any]) -> None:
        """Check the seed, the variation and the joints for the next run."""
        if start and self.node is None:
            raise UsageError(f"reset: {', '.join(start)}: the session is not open; use it in a `with` block")
        if start:
            self.node.check_start(**start)

    def start_next_with(self, start: Mapping[str, Any]) -> None:
        """Begin the next run with a checked seed, variation and joints."""
        self._next = dict(start)

    def reset(self, *, keeps_clock: bool = False) -> None:
        """Start again at time 0; with `keeps_clock`, message time goes on."""
        start, self._next = self._next, {}
        self.node.reset(keeps_clock=keeps_clock, **start)

    def loop(self, session: SessionState) -> tuple[str, str]:
        """Let time pass until the run stops; return how it ended, and the error."""
        try:
            session.loop.run()
        except SimulationError as error:
            return Outcome.UNSTABLE, f"{error}\n"
        except KeyboardInterrupt:
            return Outcome.INTERRUPTED, ""
        return self.outcome_by_now(), ""

    def outcome_by_now(self) -> Outcome:
        """Return the outcome of a run that is stopped now."""
        return final_outcome(self.node, otherwise=Outcome.UNTIL)

    def result(self, session: SessionState, outcome: str, error: str = "") -> RunResult:
        """Return the result of the run so far."""
        cell = self.node
        return RunResult(
            **session.measured(),
            outcome=Outcome(outcome),
            error=error,
            competition_state=cell.competition.state,
            score=cell.competition.score(),
            evidence=cell.competition.evidence(),
            heard=dict(self._heard),
        )

    def end(self, session: SessionState, session_result: SessionResult) -> None:
        """End the run: no more collisions; panels show the result."""
        result = cell_result(session_result)
        self.node.bus.refusals.flush()
        if self._collisions is not None:
            result.collisions = self._collisions.end()
        if not session.restart_requested:
            facts = {"outcome": outcome_word(result), "error": result.error, "state_hash": result.state_hash}
            self.cell_panel.end(facts | {"simulated": result.simulated, "wall": result.wall})
        if self.control is not None and not session.restart_requested:
            self.control.over = OVER

    @cached_property
    def cell_panel(self) -> CellPanel:
        """Panel of the cell; created at its first use."""
        panel = CellPanel(self.node, self._about)
        panel.collisions = lambda: None if self._collisions is None else self._collisions.panel()
        return panel

    def panel(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""
        return self.cell_panel.panel()

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

        camera = options.camera or VIEWS["overview"]
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
            subscribe(self.on_collision, lambda collision: events.collision(asdict(collision)), leaving)
            yield begin

    def header(self, session: SessionState, record: RecordOptions) -> RecordingHeader:
        """Return the header of a recording: the facts that the run depends on, besides external input."""
        from cellwright.recording.format.format import RecordingHeader

        cell, timestep = self.node, self.node.simulation.clock.timestep
        facts = {
            **common_facts(record),
            "seed": cell.seed,
            "servo": cell.servo,
            "competition": cell.in_competition,
            "timestep": [timestep.numerator, timestep.denominator],
            "circumstances": asdict(cell.trial.circumstances),
            "overrides": list(cell.trial.overrides),
            "varied": record.is_varied or cell.start.bounds is not None,
            "bounds": None if cell.start.bounds is None else asdict(cell.start.bounds),
            "joints": dict(cell.start.joints),
            "checkpoints": sorted(nanoseconds(when) for when, _ in session.options.checkpoints),
            **source_facts(record),
        }
        return RecordingHeader("cell", cell.name, facts)

    def recorded_panel(self, record: RecordOptions) -> dict[str, Any]:
        """Return the panel content for a recording."""
        panel = self.panel({})
        return panel | {"about": {**panel["about"], **record.about}}

    @contextmanager
    def recorded_events(self, session: SessionState, recorder: Recorder, record: RecordOptions) -> Iterator[None]:
        """Record the referee's actions, and collisions."""
        events = RunEvents(recorder.event, record.about)
        with self.events(events, {}) as begin:
            recorder.on_begin = begin
            yield
            result = cell_result(session.result)
            events.end(outcome_word(result), result.evidence, self.node.simulation.now, _facts(result))

    def recorded_end(self, result: SessionResult) -> dict[str, Any]:
        """Return the result for a recording."""
        run = cell_result(result)
        return {"outcome": outcome_word(run), "score": run.score.total, "wall": run.wall, **_facts(run)}


def cell_result(result: SessionResult | None) -> RunResult:
    """Return the result of a run of a cell."""
    assert isinstance(result, RunResult)
    return result


def _facts(result: RunResult) -> dict[str, Any]:
    facts = {"competition_state": result.competition_state, "state_hash": result.state_hash}
    return facts | {"error": result.error, "simulated": result.simulated, "steps": result.steps}


def outcome_word(result: RunResult) -> str:
    """Return the word for how a run ended, in logs, recordings and JSON."""
    return result.outcome.name.lower()


def subscribe(listeners: list[Any], listener: Callable[..., Any], leaving: ExitStack) -> None:
    """Add a listener until the stack is closed."""
    listeners.append(listener)
    leaving.callback(listeners.remove, listener)


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


def _count(heard: Counter[str], name: str, _message: object) -> None:
    heard[name] += 1
