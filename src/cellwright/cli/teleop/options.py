"""Options of a robot's controller node: how it runs, and the window and picture of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from ipaddress import ip_address
from pathlib import Path

from rich.console import Console

from cellwright.cli.arguments import PageOptions
from cellwright.cli.output import progress_bar
from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.server import Server
from cellwright.middleware.server.server import LOOPBACK
from cellwright.rendering.video_options import VideoOptions
from cellwright.robot import interface as io_teleop
from cellwright.robot.drivers import Driver
from cellwright.robot.model import TIMESTEP
from cellwright.robot.node import RobotNode
from cellwright.robot.pictures import save_robot_picture
from cellwright.robot.safety import SafetySettings
from cellwright.robot.services import RobotServices
from cellwright.robot.servos import Motion
from cellwright.running.run import RecordOptions
from cellwright.viewer.window import Window, WindowError


@dataclass(frozen=True)
class DisplayOptions:
    """What somebody wants to see.

    Attributes:
        window: MuJoCo's window, while the node runs.
        sliders: with a slider for each joint in it.
        snapshot: a picture of how the robot stands at the end goes to this file.
    """

    window: bool = False
    sliders: bool = False
    snapshot: Path | None = None

    @contextmanager
    def shown(self, node: RobotNode, server: Server) -> Iterator[None]:
        """Have the window open; it closes with the server.

        Raises:
            WindowError: there can be none; node and server are closed then.
        """
        if not self.window:
            yield
            return
        RobotServices(node).offer_state(server)
        try:
            host, port = server.address
            address = LOOPBACK if ip_address(host).is_unspecified else host
            window = Window(node.world.model, (address, port), sliders=self.sliders)
        except WindowError as error:
            node.close()
            server.close(str(error))
            raise
        try:
            yield
        finally:
            window.close()

    def save(self, node: RobotNode, console: Console) -> None:
        """Write the picture, if one is wanted; it takes some seconds.

        Raises:
            UsageError: it cannot be written.
        """
        if self.snapshot is not None:
            with progress_bar(console, f"drawing {self.snapshot}", 1.0) as tell:
                save_robot_picture(self.snapshot, node.world, node.simulation.data, progress=tell)


Load = Callable[[Callable[[str], None]], RobotConfig]
"""Gives the robot; takes what is told of warnings."""

MakeDriver = Callable[[RobotConfig], Driver]
"""Makes what moves a robot."""


@dataclass(frozen=True)
class TeleopOptions:
    """What running a robot's node may be told.

    Attributes:
        motion: how targets are reached.
        timestep: length of a step of physics [s].
        self_collision: whether links may touch each other.
        safety: what is guarded against.
        sim_time: tell simulation time on /clock, and stamp messages with it.
        speed: simulated seconds a wall second; None: as fast as it goes.
        lockstep: let time pass only when a guest asks.
        until: stop at this simulation time [s]; None: when somebody stops it.
        host: address to listen at.
        port: port to listen at, as `Server` takes it.
        ros1: be a node of ROS 1 too.
        node: its name there.
        driver: makes what moves the robot in place of the simulation.
        sight: what somebody wants to see.
        as_json: print the summary as JSON, and nothing else on stdout.
        verbose: say also how time kept to the wall clock.
        page: a page on it; None for none.
        paused: let time stand until somebody on the page lets it pass.
        record: how it is recorded; None for not at all.
        video: a video to be written; it is not waited for where time keeps to the wall clock.
    """

    motion: Motion = Motion.SERVO
    timestep: Fraction = TIMESTEP
    self_collision: bool = False
    safety: SafetySettings = field(default_factory=SafetySettings)
    sim_time: bool = False
    speed: float | None = 1.0
    lockstep: bool = False
    until: float | None = None
    host: str = LOOPBACK
    port: int | None = None
    ros1: bool = False
    node: str = io_teleop.NODE
    driver: MakeDriver | None = None
    sight: DisplayOptions = field(default_factory=DisplayOptions)
    as_json: bool = False
    verbose: bool = False
    page: PageOptions | None = None
    paused: bool = False
    record: RecordOptions | None = None
    video: VideoOptions | None = None
