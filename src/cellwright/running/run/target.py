"""Targets of a session: what each of them has, and what only some can do.

A session asks for an ability by its protocol, `isinstance(target, Restartable)`, and does without it otherwise.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

from cellwright.config.parsing.sources import Sources
from cellwright.config.trial.trial import Trial
from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.engine.rate_control import RateControl
from cellwright.running.run.options import RunOptions
from cellwright.running.run.result import Outcome, RunResult, SessionResult, versions

if TYPE_CHECKING:
    from cellwright.middleware.ros1.identity import Identity
    from cellwright.middleware.server import Server
    from cellwright.recording.format.format import RecordingHeader
    from cellwright.recording.format.run_log import RunEvents
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.viewer.filming import VideoRecorder
    from cellwright.viewer.services.control import Control
    from cellwright.viewer.services.entity_services import EntityServices


@dataclass(frozen=True)
class RunControls:
    """Controls of time that a session lends its target.

    Attributes:
        rate: rate at which time passes.
        stop: stop condition of the run.
        report: receives a line about a file that is not as it should be.
    """

    rate: RateControl
    stop: StopCondition
    report: Callable[[str], None]


class Target(ABC):
    """Target of a session: a node whose time passes. What else it can do is in the protocols below.

    Attributes:
        node: the node, once the target is open; None before.
        acts: verb phrase for what clients can do, for a warning.
        stopped: reason for the end of the server if no other is known.
    """

    node: Any = None
    acts: ClassVar[str]
    stopped: ClassVar[str]

    @abstractmethod
    def open(self, controls: RunControls) -> None:
        """Make the node, or take an existing one."""

    @abstractmethod
    def close(self) -> None:
        """Release the node; a second call does nothing."""


@runtime_checkable
class Prepared(Protocol):
    """Target whose runs need preparations."""

    def begin(self, options: RunOptions, run: ExitStack) -> None:
        """Start a run; `run` restores the state before it."""


@runtime_checkable
class Ending(Protocol):
    """Target that acts at the end of a run, while its clients are still connected."""

    def end(self, result: SessionResult, *, restarts: bool) -> SessionResult:
        """End the run, which `restarts` or is over; return its result with what is known by now."""


@runtime_checkable
class Player(Protocol):
    """Target that lets its time pass itself, and has an end of its own."""

    def play(self, loop: SimulationLoop) -> None:
        """Let time pass until the loop stops, or until the end."""


@runtime_checkable
class RealTime(Protocol):
    """Target whose time may not stand, while a real robot moves on."""

    def moves_real_robot(self) -> bool:
        """Return True if time may not wait for slow clients."""


@runtime_checkable
class Restartable(Protocol):
    """Target that can start again."""

    def reset(self, *, keeps_clock: bool = False) -> None:
        """Start again while clients stay connected; see `Simulation.reset` for `keeps_clock`.

        Raises:
            RejectedCommandError: it may not start again now.
        """


@runtime_checkable
class Refereed(Protocol):
    """Cell: an agent works it from time 0, a referee scores it, and the events of a run can be logged."""

    def start_next_with(self, start: Mapping[str, Any]) -> None:
        """Begin the next run with this seed, variation and joints.

        Raises:
            UsageError: one is out of range; nothing is changed.
        """

    def outcome_by_now(self) -> Outcome:
        """Return the outcome of a run that is stopped now."""

    def latest_end(self) -> int:
        """Return the simulation time [ns] at which the referee ends the run at the latest."""

    def judged(self, measured: SessionResult) -> RunResult:
        """Return the result of the run so far, from the figures of any session."""

    def events(self, events: RunEvents, more: Mapping[str, Any]) -> AbstractContextManager[Callable[[], None]]:
        """Report the events of a run; the result starts it once more, as after a reset."""


@runtime_checkable
class HasPanel(Protocol):
    """Target that pages and other viewers can show."""

    def panel(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""

    def offer(self, served: Served) -> None:
        """Offer the services of a server for viewers."""


@runtime_checkable
class RosNamed(Protocol):
    """Target that can be a node of ROS.

    Attributes:
        identity: its node in ROS 1; None: the simulator of 2017.
        controller_names: names that ros2_control has for topics and services, by their own.
    """

    identity: Identity | None
    controller_names: Mapping[str, str]

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters of its node: for the parameter server of ROS 1, and of the node in ROS 2."""


@runtime_checkable
class Recordable(Protocol):
    """Target whose runs can be recorded."""

    def stamp(self) -> Callable[[], int] | None:
        """Return the source of a second time stamp for commands; None for none."""

    def origin(self, collected: Sources) -> Origin:
        """Return the files that it was made from, of those `collected` meanwhile."""

    def header(self, about: Mapping[str, Any], origin: Origin) -> RecordingHeader:
        """Return the header of a recording: the facts that the run depends on, besides external input."""

    def recorded_panel(self, about: Mapping[str, Any]) -> dict[str, Any]:
        """Return the panel content for a recording."""


@runtime_checkable
class Filmable(Protocol):
    """Target whose runs can be filmed."""

    def film(self, options: VideoOptions, *, waits: bool, report: Callable[[str], None]) -> VideoRecorder:
        """Return a video of it, not started.

        Raises:
            RenderingError: the file cannot be written.
        """


@dataclass(frozen=True)
class Origin:
    """Files that a target was made from.

    Attributes:
        sources: all of them; None if they were not collected.
        files: those that were named, in their order.
    """

    sources: Sources | None = None
    files: Sequence[Path] = field(default_factory=tuple)

    def facts(self) -> dict[str, list[str]]:
        """Return their names in a recording: of named files, and of folders of ROS packages."""
        sources = self.sources
        if sources is None:
            return {"files": [], "packages": []}
        return {"files": [sources.name(path) for path in self.files], "packages": sources.packages()}


@dataclass(frozen=True)
class Served:
    """Server of a session, and what its viewers may ask of the session.

    Attributes:
        server: serves the clients.
        controls: controls of time.
        reset: restarts the run; takes `keeps_clock`.
        restart_refusal: reason why a run may not start again, besides those of its target; empty for none.
        state_refusal: returns why it may not start again while the clock goes on; empty if it may.
        load_world: ends the session soon, and starts another one with a trial; None if that is not possible.
    """

    server: Server
    controls: RunControls
    reset: Callable[..., None]
    restart_refusal: str
    state_refusal: Callable[[], str]
    load_world: Callable[[Trial], None] | None = None

    def offer_simulation(
        self,
        target: HasPanel,
        node: Any,
        *,
        restart_refusal: Callable[[], str],
        refused: Mapping[str, str],
        has_clock: bool = True,
        entities: EntityServices | None = None,
    ) -> Control:
        """Offer the services of a simulation; return the control of its time.

        Args:
            target: has the panel.
            node: the simulated node.
            restart_refusal: returns why it may not start again; empty if it may.
            refused: refused actions on its time, with the reasons.
            has_clock: False if messages carry wall time.
            entities: services of its entities; None if it has none.
        """
        from cellwright.viewer.services.control import Control, Reset
        from cellwright.viewer.services.scene import offer_viewer_services
        from cellwright.viewer.services.simulation import SimulationServices

        control = Control(
            self.controls.rate,
            reset=Reset(
                self.reset,
                lambda: restart_refusal() or self.restart_refusal,
                partial(self.reset, keeps_clock=True),
                self.state_refusal,
            ),
            refused=refused,
            lockstep=self.server.lockstep,
        )
        offer_viewer_services(self.server, node, target.panel, control)
        if isinstance(target, RosNamed):
            self.server.offer("cellwright/parameters", lambda _request: target.ros_parameters())
        SimulationServices(
            node, control, stop=self.controls.stop, entities=entities, load=self.load_world, has_clock=has_clock
        ).offer(self.server)
        return control


def subscribe(listeners: list[Any], listener: Callable[..., Any], leaving: ExitStack) -> None:
    """Add a listener until the stack is closed."""
    listeners.append(listener)
    leaving.callback(listeners.remove, listener)


def common_facts(about: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts of every recording as JSON values, with those of the caller."""
    return {"versions": versions(), "recorded": datetime.now(UTC).isoformat(timespec="seconds"), **about}
