"""What running a robot's controller node may be told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction

from cellwright.cli.teleop.sight import Sight
from cellwright.cli.view.arguments import PageWish
from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.server.server import LOOPBACK
from cellwright.rendering.video_wish import VideoWish
from cellwright.robot.drivers.driver import Driver
from cellwright.robot.interface import rows as io_teleop
from cellwright.robot.model.robot import TIMESTEP
from cellwright.robot.safety.settings import SafetySettings
from cellwright.robot.servos import Motion
from cellwright.running.run import RecordOptions

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
    sight: Sight = field(default_factory=Sight)
    as_json: bool = False
    verbose: bool = False
    page: PageWish | None = None
    paused: bool = False
    record: RecordOptions | None = None
    video: VideoWish | None = None
