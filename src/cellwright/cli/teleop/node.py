"""Running a robot's controller node from the command line: the node, its server, and what is said of it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial

import typer
from rich.console import Console

from cellwright.cli import lines, recorded, videos
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.signals import Stop, stopped_by_signals
from cellwright.cli.teleop import summary
from cellwright.cli.teleop.film import film
from cellwright.cli.teleop.options import Load, TeleopOptions
from cellwright.cli.teleop.progress import NodeProgress
from cellwright.cli.teleop.ros1 import RosSide
from cellwright.cli.teleop.summary import Ran
from cellwright.cli.view.page import page_on
from cellwright.engine.clock import nanoseconds
from cellwright.engine.events import NEVER
from cellwright.engine.tempo import Tempo
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.ros1.host.identity import robot
from cellwright.middleware.server import Server
from cellwright.middleware.server.timekeeper import Timekeeper
from cellwright.robot.node import RobotNode
from cellwright.running.run.record_robot import RobotRecording, RobotSettings
from cellwright.running.serving import Pace
from cellwright.util.errors import SimulationError, UsageError
from cellwright.viewer.services import onlookers
from cellwright.viewer.services.control import Control, Reset
from cellwright.viewer.services.robot_panel import RobotPanel

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
    tell: Callable[[str], None] = lines.warn
    identity = robot(wanted.node, sim_time=wanted.sim_time)
    with stopped_by_signals(is_stopped.stop), ExitStack() as to_close:
        config, record = recorded.with_sources(wanted.record, lambda: load(lines.warn), lambda found: [found.path])
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
            lines.warn(f"{wanted.host}: anybody who reaches this machine can drive the robot")
        in_ros = ros.join(config, server)
        to_close.enter_context(wanted.sight.shown(node, server))  # before the clock starts: it takes a moment

        def poll() -> None:
            progress.update()
            ros.poll()

        recording = None if record is None else RobotRecording(node, record, _settings(identity.node, wanted))
        if recording is not None:
            to_close.callback(recording.end)
        tempo = Tempo(wanted.speed, paused=wanted.paused)
        onlookers.offer(server, node, RobotPanel(node).tell, _control(node, tempo, wanted))
        say = partial(console.print, markup=False, soft_wrap=True)
        to_close.enter_context(page_on(server, wanted.page, f"{node.name} · Cellwright", say))
        keeper = Timekeeper(node, server, tempo=tempo, on_poll=poll, can_stand=wanted.driver is None)
        progress = NodeProgress(
            console,
            node,
            until=wanted.until,
            factor=lambda: None if keeper.tempo.speed is None else keeper.pacer.factor,
        )
        tell = progress.line
        is_stopped.follow(partial(setattr, keeper, "is_stopped", True))
        waits = wanted.lockstep or wanted.speed is None
        filming = None if wanted.video is None else film(node, wanted.video, waits=waits, warn=lines.warn)
        if filming is not None:
            filming.start()
        with progress.running():
            if not is_stopped.has_come:
                console.print(
                    lines.ready(node.name, server, wanted.speed) + in_ros + _off(node), markup=False, soft_wrap=True
                )
            ran = _run(node, server, keeper, wanted)
        if filming is not None:
            ran.videos, ran.is_recorded = [filming.finish()], filming.is_whole
        if recording is not None:
            recording.end({"outcome": ran.outcome, "error": ran.error, "wall": ran.wall})
            ran.recordings, ran.is_recorded = recording.files, ran.is_recorded and recording.is_whole
    if not wanted.as_json:
        summary.show(console, node, wanted, ran)
    try:
        wanted.sight.save(node, console)  # after the summary, since it takes a while
    except UsageError as error:
        ran.error = ran.error or str(error)
    else:
        if wanted.sight.snapshot is not None and not wanted.as_json:
            lines.note(console, "picture", str(wanted.sight.snapshot))
    if not wanted.as_json:
        lines.note_files(console, "video", map(videos.sentence, ran.videos))
        lines.note_files(console, "recording", ran.recordings)
    status = NOT_DONE if ran.error or not ran.is_recorded else DONE
    if ran.error:
        typer.echo(f"error: {ran.error}", err=True)
    if wanted.as_json:
        typer.echo(json.dumps(summary.document(node, wanted, ran, status), indent=2))
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


def _control(node: RobotNode, tempo: Tempo, wanted: TeleopOptions) -> Control:
    """What may be done about the time of a robot: that of a real one passes as it does."""
    refused: dict[str, str] = {}
    if wanted.driver is not None:
        refused = dict.fromkeys(("pause", "resume", "step", "speed"), "a real robot keeps real time")
    elif not wanted.sim_time:
        refused = {"speed": "messages carry the wall clock's time: --sim-time lets it go at another speed"}

    def go_home() -> None:
        node.bus.call(_RESET, TriggerRequest(), node="/page")

    return Control(tempo, reset=Reset(go_home), refused=refused, lockstep=wanted.lockstep)


def _run(node: RobotNode, server: Server, keeper: Timekeeper, wanted: TeleopOptions) -> Ran:
    """Let time pass until it is over; the node and its server are closed then."""
    ran, begun = Ran(), time.perf_counter()
    end = NEVER if wanted.until is None else nanoseconds(wanted.until)
    try:
        keeper.run(lambda: end, lambda: "the node has stopped")
        if not keeper.is_stopped:
            ran.outcome = "until"
    except SimulationError as error:
        ran.outcome, ran.error = "unstable", str(error)
    finally:
        ran.wall = time.perf_counter() - begun
        node.close()
        server.close("the node has stopped")
    if keeper.tempo.speed is not None and not wanted.lockstep:
        ran.pace = Pace(keeper.pacer.factor, keeper.pacer.worst, keeper.pacer.stood)
    node.bus.refusals.flush()
    return ran


def _off(node: RobotNode) -> str:
    """What the ready line says of a node that takes no commands yet."""
    return "" if node.commander.is_enabled else ", takes no commands until /io_teleop/set_enabled says so"
