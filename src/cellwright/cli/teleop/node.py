"""Controller node of a robot, run from the command line: in ROS, with its video, progress and summary."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console

from cellwright.cli import arguments, output
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.output import ShowProgress, progress_bar
from cellwright.cli.page import page_for
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.cli.teleop.options import Load, TeleopOptions
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.meshes import with_absolute_meshes
from cellwright.config.robot.urdf_file import read_text
from cellwright.engine.clock import nanoseconds
from cellwright.engine.loop import Loop, Pace, StopCondition
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.ros1.host.ros1 import Identity, robot_identity
from cellwright.middleware.server import Server
from cellwright.rendering.video_options import VideoOptions
from cellwright.robot.interface.rows import ros_parameters
from cellwright.robot.node import RobotNode
from cellwright.robot.pictures import robot_camera, robot_lamp
from cellwright.running.run import versions
from cellwright.running.run.record_robot import RobotRecording, RobotSettings
from cellwright.util.errors import DescriptionError, SimulationError, UsageError
from cellwright.viewer.filming import Filming, still
from cellwright.viewer.services import scene
from cellwright.viewer.services.control import Control, Reset
from cellwright.viewer.services.robot_panel import RobotPanel

if TYPE_CHECKING:
    from cellwright.viewer.filming import Made


@dataclass(frozen=True)
class RosSide:
    """A robot's node in ROS, or the lack of one.

    Attributes:
        ros: master and bridge; None where the robot is not to be known in ROS.
        identity: as whom it is known.
    """

    ros: Ros1 | None
    identity: Identity

    @classmethod
    def made(
        cls, identity: Identity, warn: Callable[[str], None], is_stopped: Callable[[], bool], *, wanted: bool
    ) -> RosSide:
        """It, with a master that answers, if it is wanted.

        Raises:
            UsageError: ROS 1 is not installed.
        """
        return cls(Ros1(warn, is_stopped, identity=identity) if wanted else None, identity)

    @property
    def running(self) -> AbstractContextManager[object]:
        """Ends with a block whatever was started."""
        return nullcontext() if self.ros is None else self.ros

    def prepare(self) -> None:
        """Have a master.

        Raises:
            UsageError: there is none, or a node of our name is there.
        """
        if self.ros is not None:
            self.ros.prepare()

    def join(self, config: RobotConfig, server: Server) -> str:
        """Be known in ROS, and serve guests until then; what a ready line has to say of it.

        Raises:
            UsageError: it did not work.
        """
        if self.ros is None:
            return ""
        told = ros_parameters(urdf_text(config), node=self.identity.node, sim_time=self.identity.tells_time)
        self.ros.join(server.address, told, server.wait)
        return f", ROS 1 at {self.ros.master.uri} as {self.identity.node}"

    def poll(self) -> None:
        """Look after it."""
        if self.ros is not None:
            self.ros.poll()


def urdf_text(config: RobotConfig) -> str:
    """The text of a robot's URDF, for programs elsewhere; empty where there is none to be read."""
    try:
        return with_absolute_meshes(read_text(config.urdf_path), config.urdf_path)
    except DescriptionError:  # a robot that was made in memory has none
        return ""


def film_robot(node: RobotNode, wanted: VideoOptions, *, waits: bool, warn: Callable[[str], None]) -> Filming:
    """A video of a robot, which is seen whole as it stands now, with the time in its corner.

    Args:
        node: whose robot it is.
        wanted: what was asked for.
        waits: hold time until a frame can be drawn.
        warn: takes a line about what goes wrong.

    Raises:
        RenderingError: it cannot be written.
    """
    camera = wanted.camera or robot_camera(node.world, node.simulation.data, wanted.width, wanted.height)
    return Filming(
        node,
        wanted,
        camera=still(camera),
        caption=lambda: f"{node.simulation.time:.1f} s",
        waits=waits,
        warn=warn,
        lamp=robot_lamp(camera),
    )


class NodeProgress:
    """Tells on a console how a node goes.

    Args:
        console: where to.
        node: what runs.
        until: the simulation time [s] at which it is to stop, if any.
        factor: simulated seconds a wall second so far, if time keeps to the wall clock.
    """

    def __init__(self, console: Console, node: RobotNode, *, until: float | None, factor: Callable[[], float | None]):
        self._console, self._node, self._until, self._factor = console, node, until, factor
        self._bar: ShowProgress | None = None

    @contextmanager
    def running(self) -> Iterator[None]:
        """Tell of what happens inside."""
        try:
            with progress_bar(self._console, self._node.name, self._until) as self._bar:
                yield
        finally:
            self._bar = None

    def update(self) -> None:
        """Show how far it is, where somebody sees it move."""
        if self._bar is None:
            return
        node, factor = self._node, self._factor()
        pace = "" if factor is None else f"  {factor:.2f} x real time"
        commands = f"  {node.counts.taken} commands taken, {node.refused} refused, {node.counts.ignored} ignored"
        time = node.simulation.time
        self._bar(time if self._until else None, f"{time:.1f} s{pace}{commands}")

    def line(self, text: str) -> None:
        """A line that stays, with the simulation time."""
        self._console.print(
            f"{self._node.simulation.time:9.3f} s  {text}", markup=False, soft_wrap=True, style="yellow"
        )


@dataclass
class NodeResult:
    """What came of a node."""

    outcome: str = "stopped"
    error: str = ""
    wall: float = 0.0
    pace: Pace | None = field(default=None)
    recordings: Sequence[Path] = ()
    is_recorded: bool = True
    videos: Sequence[Made] = ()


def show_node_result(console: Console, node: RobotNode, wanted: TeleopOptions, ran: NodeResult) -> None:
    """Tell people what came of it."""
    counts = node.counts
    console.print()
    note = partial(output.note, console)
    note("commands", f"{counts.taken} taken, {node.refused} refused, {counts.ignored} ignored")
    for source, count in sorted(node.bus.refusals.counts.items()):
        note(f"refused {count}", source)
    note("simulated" if wanted.driver is None else "ran", f"{node.simulation.time:.1f} s in {ran.wall:.1f} s")
    if ran.pace is not None:
        note("pace", output.pace_text(ran.pace))
    if wanted.verbose:
        note("state hash", node.simulation.state_hash())
        note("versions", ", ".join(f"{name} {version}" for name, version in versions().items()))


def node_document(node: RobotNode, wanted: TeleopOptions, ran: NodeResult, status: int) -> dict[str, Any]:
    """The summary as JSON values; times in s."""
    return {
        "robot": node.name,
        "motion": wanted.motion.value,
        "timestep": float(wanted.timestep),
        "outcome": ran.outcome,
        "exit_status": status,
        "error": ran.error,
        "simulated": node.simulation.time,
        "wall": ran.wall,
        "steps": node.simulation.clock.tick,
        "state_hash": node.simulation.state_hash(),
        "commands": {"taken": node.counts.taken, "refused": node.refused, "ignored": node.counts.ignored},
        "refused": dict(node.bus.refusals.counts),
        "unknown_names": list(node.commander.notices.unknown),
        "pace": None if ran.pace is None else asdict(ran.pace),
        "recordings": [str(path) for path in ran.recordings],
        "videos": list(ran.videos),
        "versions": versions(),
    }


_STOPPED = "the node has stopped"
_RESET = "/io_teleop_reset_robot"


def run_node(load: Load, wanted: TeleopOptions) -> int:
    """Run a robot's node until a signal ends it or its time is over, and print what came of it.

    Args:
        load: gives the robot.
        wanted: how.

    Returns:
        The exit status.
    """
    console = Console(stderr=wanted.as_json, highlight=False)
    is_stopped = Stop()
    tell: Callable[[str], None] = output.warn
    identity = robot_identity(wanted.node, sim_time=wanted.sim_time)
    with stopped_by_signals(is_stopped.stop), ExitStack() as to_close:
        config, record = arguments.read_with_sources(
            wanted.record, lambda: load(output.warn), lambda found: [found.path]
        )
        ros = RosSide.made(identity, lambda line: tell(line), lambda: is_stopped.has_come, wanted=wanted.ros1)
        to_close.enter_context(ros.running)
        ros.prepare()
        node = RobotNode(
            config,
            motion=wanted.motion,
            timestep=wanted.timestep,
            self_collision=wanted.self_collision,
            safety=wanted.safety,
            node=identity.node,
            sim_time=wanted.sim_time,
            stamp=time.time_ns,
            report=lambda line: tell(line),
            driver=None if wanted.driver is None else wanted.driver(config),
        )
        to_close.callback(node.close)  # a driver is let go of whatever comes
        server = Server(
            node, host=wanted.host, port=wanted.port, lockstep=wanted.lockstep, report=lambda line: tell(line)
        )
        if not server.is_local:
            output.warn(f"{wanted.host}: anybody who reaches this machine can drive the robot")
        in_ros = ros.join(config, server)
        to_close.enter_context(wanted.sight.shown(node, server))  # before the clock starts: it takes a moment

        def poll() -> None:
            progress.update()
            ros.poll()

        recording = None if record is None else RobotRecording(node, record, _settings(identity.node, wanted))
        if recording is not None:
            to_close.callback(recording.end)
        tempo = RateControl(wanted.speed, paused=wanted.paused)
        scene.offer_viewer_services(server, node, RobotPanel(node).tell, _control(node, tempo, wanted))
        say = partial(console.print, markup=False, soft_wrap=True)
        to_close.enter_context(page_for(server, wanted.page, f"{node.name} · Cellwright", say))
        stop = StopCondition(None if wanted.until is None else nanoseconds(wanted.until), _STOPPED)
        keeper = Loop(node.simulation, server, rate=tempo, stop=stop, on_poll=poll, can_stand=wanted.driver is None)
        progress = NodeProgress(
            console, node, until=wanted.until, factor=lambda: None if keeper.rate.speed is None else keeper.pacer.factor
        )
        tell = progress.line
        is_stopped.follow(keeper.stop.request)
        waits = wanted.lockstep or wanted.speed is None
        filming = None if wanted.video is None else film_robot(node, wanted.video, waits=waits, warn=output.warn)
        if filming is not None:
            filming.start()
        with progress.running():
            if not is_stopped.has_come:
                console.print(
                    output.ready_line(node.name, server, wanted.speed) + in_ros + _disabled_note(node),
                    markup=False,
                    soft_wrap=True,
                )
            ran = _run_until_stopped(node, server, keeper)
        if filming is not None:
            ran.videos, ran.is_recorded = [filming.finish()], filming.is_whole
        if recording is not None:
            recording.end({"outcome": ran.outcome, "error": ran.error, "wall": ran.wall})
            ran.recordings, ran.is_recorded = recording.files, ran.is_recorded and recording.is_whole
    if not wanted.as_json:
        show_node_result(console, node, wanted, ran)
    try:
        wanted.sight.save(node, console)  # after the summary, since it takes a while
    except UsageError as error:
        ran.error = ran.error or str(error)
    else:
        if wanted.sight.snapshot is not None and not wanted.as_json:
            output.note(console, "picture", str(wanted.sight.snapshot))
    if not wanted.as_json:
        output.note_files(console, "video", map(arguments.video_sentence, ran.videos))
        output.note_files(console, "recording", ran.recordings)
    status = NOT_DONE if ran.error or not ran.is_recorded else DONE
    if ran.error:
        typer.echo(f"error: {ran.error}", err=True)
    if wanted.as_json:
        typer.echo(json.dumps(node_document(node, wanted, ran, status), indent=2))
    return status


def _settings(node: str, wanted: TeleopOptions) -> RobotSettings:
    return RobotSettings(
        motion=wanted.motion,
        timestep=wanted.timestep,
        self_collision=wanted.self_collision,
        safety=wanted.safety,
        node=node,
        sim_time=wanted.sim_time,
        driver=wanted.driver is not None,
    )


def _control(node: RobotNode, tempo: RateControl, wanted: TeleopOptions) -> Control:
    """What may be done about the time of a robot: that of a real one passes as it does."""
    refused: dict[str, str] = {}
    if wanted.driver is not None:
        refused = dict.fromkeys(("pause", "resume", "step", "speed"), "a real robot keeps real time")
    elif not wanted.sim_time:
        refused = {"speed": "messages carry the wall clock's time: --sim-time lets it go at another speed"}

    def go_home() -> None:
        node.bus.call(_RESET, TriggerRequest(), node="/page")

    return Control(tempo, reset=Reset(go_home), refused=refused, lockstep=wanted.lockstep)


def _run_until_stopped(node: RobotNode, server: Server, keeper: Loop) -> NodeResult:
    """Let time pass until it is over; the node and its server are closed then."""
    ran, begun = NodeResult(), time.perf_counter()
    try:
        keeper.run()
        if not keeper.stop.is_requested:
            ran.outcome = "until"
    except SimulationError as error:
        ran.outcome, ran.error = "unstable", str(error)
    finally:
        ran.wall = time.perf_counter() - begun
        node.close()
        server.close("the node has stopped")
    ran.pace = keeper.pace
    node.bus.refusals.flush()
    return ran


def _disabled_note(node: RobotNode) -> str:
    """What the ready line says of a node that takes no commands yet."""
    return "" if node.commander.is_enabled else ", takes no commands until /io_teleop/set_enabled says so"
