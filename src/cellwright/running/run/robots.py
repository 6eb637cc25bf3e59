"""Session target that runs a robot controller node."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from cellwright.config.parsing.sources import Sources
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.description import description
from cellwright.config.robot.mjcf_file import is_mjcf
from cellwright.config.robot.robots import load_robot
from cellwright.config.robot.urdf_file import read_text
from cellwright.config.robot.urdf_writer import write_urdf
from cellwright.middleware.ros1.identity import Identity
from cellwright.recording.format.format import RecordingHeader
from cellwright.rendering.views import camera_of, gear2017_views
from cellwright.robot.commander import CLEAR_STOP
from cellwright.robot.interface import CONTROLLER_NAMES, NODE, robot_identity, ros_parameters
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.pictures import TILT, TURN, camera_on, robot_heading, robot_lamp
from cellwright.running.run.result import SessionResult
from cellwright.running.run.target import Origin, RunControls, Served, Target, common_facts
from cellwright.util.errors import CellwrightError, DescriptionError, RejectedCommandError
from cellwright.viewer.services.robot_panel import RobotPanel

if TYPE_CHECKING:
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.viewer.filming import VideoRecorder

REAL_ROBOT = "a real robot is not reset; move it home with /io_teleop_reset_robot"
"""Reason why a real robot is not reset."""


class RobotTarget(Target):
    """A robot controller node.

    Args:
        make: returns the node when the session opens: a new one, or an existing one.
        node: its name in ROS.
        sim_time: True if messages carry simulation time.

    Raises:
        UsageError: the name is not valid for a node.
    """

    acts, stopped = "drive the robot", "the node has stopped"
    controller_names: Mapping[str, str] = MappingProxyType(CONTROLLER_NAMES)
    node: RobotNode

    _was_loaded = False  # true if a program had loaded the robot before

    def __init__(self, make: Callable[[], RobotNode], *, node: str = NODE, sim_time: bool = False) -> None:
        self._make = make
        self.identity: Identity | None = robot_identity(node, sim_time=sim_time)

    @classmethod
    def of(cls, robot: RobotNode | RobotConfig | Callable[[], RobotConfig], *, is_real_time: bool) -> RobotTarget:
        """Return the target of a node, or of one that is made from a robot; in real time it follows the wall clock."""
        if isinstance(robot, RobotNode):
            target = cls(lambda: robot, node=robot.settings.node, sim_time=robot.settings.sim_time)
        else:

            def make() -> RobotNode:
                config = robot if isinstance(robot, RobotConfig) else robot()
                return RobotNode(config, RobotSettings(sim_time=not is_real_time), stamp=time.time_ns)

            target = cls(make, sim_time=not is_real_time)
        target._was_loaded = isinstance(robot, RobotNode | RobotConfig)
        return target

    def open(self, controls: RunControls) -> None:  # noqa: ARG002 - a robot's run has no end of its own
        """Make the node."""
        self.node = self._make()
        self._panel = RobotPanel(self.node)

    def stamp(self) -> Callable[[], int]:
        """Return the source of the time at which a command has arrived, as messages carry it [ns]."""
        return lambda: self.node.commander.gate.arrived

    def moves_real_robot(self) -> bool:
        """Return True if a driver moves a real robot."""
        return self.node.has_driver

    def origin(self, collected: Sources) -> Origin:
        """Return the files of the robot."""
        return Origin(collected, self._named_files())

    def _named_files(self) -> list[Path]:
        """Configuration file of the robot; none if the robot is not that of its file, as one changed by a program."""
        config = self.node.config
        if not self._was_loaded:
            return [config.path]
        # Read again, so that its sources are collected.
        try:
            is_as_in_file = load_robot(config.path, lambda _line: None, config.xacro_arguments) == config
        except CellwrightError:
            return []
        return [config.path] if is_as_in_file else []

    def close(self) -> None:
        """Close the node; a second call does nothing."""
        self.node.close()

    def ready_note(self) -> str:
        """Note about a node that takes no commands yet."""
        return "" if self.node.commander.is_enabled else ", commands disabled until enabled with /io_teleop/set_enabled"

    def reset(self, *, keeps_clock: bool = False) -> None:
        """Start again in the initial posture; with `keeps_clock`, message time goes on.

        Raises:
            RejectedCommandError: the emergency stop is on.
        """
        if self.node.commander.is_stopped:
            raise RejectedCommandError(f"the emergency stop is on; {CLEAR_STOP}")
        self.node.simulation.reset(keeps_clock=keeps_clock)

    def restart_refusal(self) -> str:
        """Return why the node may not start again: a real robot has to move."""
        return REAL_ROBOT if self.moves_real_robot() else ""

    def end(self, result: SessionResult, *, restarts: bool) -> SessionResult:  # noqa: ARG002 - a robot's run goes on
        """Release a real robot at once: the run is over."""
        if self.moves_real_robot():
            self.node.close()
        self.node.bus.refusals.flush()
        return result

    def offer(self, served: Served) -> None:
        """Offer the services for viewers."""
        served.offer_simulation(
            self,
            self.node,
            restart_refusal=self.restart_refusal,
            refused=self._refused(),
            has_clock=self.identity is None or self.identity.tells_time,
        )

    def _refused(self) -> dict[str, str]:
        """Refused actions on its time, with the reasons: the time of a real robot cannot be controlled."""
        if self.moves_real_robot():
            return dict.fromkeys(("pause", "resume", "step", "speed"), "a real robot runs in real time")
        if not self.node.settings.sim_time:
            return {"speed": "messages carry wall time; another speed requires --sim-time"}
        return {}

    def panel(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the content of a panel as JSON values."""
        return self._panel.state(request)

    def ros_parameters(self) -> dict[str, Any]:
        """Parameters for the parameter server of ROS 1."""
        assert self.identity is not None
        text = urdf_text(self.node.config)
        return dict(ros_parameters(text, node=self.identity.node, sim_time=self.identity.tells_time))

    def film(self, options: VideoOptions, *, waits: bool, report: Callable[[str], None]) -> VideoRecorder:
        """Return a video of the whole robot at its present place, with the time in a corner."""
        from cellwright.rendering.video_options import SIZE
        from cellwright.viewer.filming import VideoRecorder

        node = self.node
        model, data = node.simulation.model, node.simulation.data
        heading = robot_heading(node.world, data) + TURN
        camera = (
            camera_on(model, data, heading, TILT, *(options.size or SIZE))
            if options.camera is None
            else camera_of(options.camera, gear2017_views())
        )
        return VideoRecorder(
            node,
            options,
            camera=camera,
            caption=lambda: f"{node.simulation.time:.1f} s",
            waits=waits,
            warn=report,
            lamp=robot_lamp(camera),
        )

    def header(self, about: Mapping[str, Any], origin: Origin) -> RecordingHeader:
        """Return the header of a recording: the facts that the node was made from."""
        facts = {**common_facts(about), **self.node.made_with, **origin.facts()}
        if self.node.config.xacro_arguments:
            facts["xacro_arguments"] = dict(self.node.config.xacro_arguments)
        return RecordingHeader("robot", self.node.name, facts)

    def recorded_panel(self, _about: Mapping[str, Any]) -> dict[str, Any]:
        """Return the panel content for a recording."""
        return self.panel({})


def urdf_text(config: RobotConfig) -> str:
    """Return the text of a robot's URDF, for programs elsewhere; empty if there is no file."""
    path = config.urdf_path
    try:
        text = write_urdf(config.robot) if is_mjcf(path) else read_text(path, config.xacro_arguments)
        return description(text, config.robot, path)
    except DescriptionError:  # a robot that was made in memory has none
        return ""
