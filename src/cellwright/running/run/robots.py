"""A robot's node as what a session runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.meshes import with_absolute_meshes
from cellwright.config.robot.urdf_file import read_text
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.ros1.host.ros1 import robot_identity
from cellwright.recording.format.format import RecordingHeader
from cellwright.robot.interface import NODE, ros_parameters
from cellwright.robot.node import RobotNode
from cellwright.robot.pictures import TILT, TURN, camera_on, robot_heading, robot_lamp, save_robot_picture
from cellwright.robot.services import RobotServices
from cellwright.running.run.options import RecordOptions, reachable_address
from cellwright.running.run.result import SessionResult
from cellwright.running.run.targets import SessionState, Target, common_facts, source_facts
from cellwright.util.errors import DescriptionError
from cellwright.viewer.services.robot_panel import RobotPanel
from cellwright.viewer.window import Window

if TYPE_CHECKING:
    from cellwright.rendering.picture import Progress
    from cellwright.rendering.video_options import VideoOptions
    from cellwright.viewer.filming import Filming

_RESET = "/io_teleop_reset_robot"


class RobotTarget(Target):
    """A robot's node.

    Args:
        sim_time: whether messages carry simulation time.

    Raises:
        UsageError: no node can have this name.
    """

    acts, stopped = "drive the robot", "the node has stopped"
    node: RobotNode

    def __init__(self, make: Callable[[], RobotNode], *, node: str = NODE, sim_time: bool = False) -> None:
        super().__init__(make)
        self.identity = robot_identity(node, sim_time=sim_time)

    @classmethod
    def of(cls, robot: RobotNode | RobotConfig | Callable[[], RobotConfig], *, is_real_time: bool) -> RobotTarget:
        """A node that is there, or one that is made of a robot: in real time it lives by the wall clock."""
        if isinstance(robot, RobotNode):
            made = robot.made_with
            return cls(lambda: robot, node=str(made["node"]), sim_time=bool(made["sim_time"]))

        def make() -> RobotNode:
            config = robot if isinstance(robot, RobotConfig) else robot()
            return RobotNode(config, sim_time=not is_real_time, stamp=time.time_ns)

        return cls(make, sim_time=not is_real_time)

    def open(self, session: SessionState) -> None:
        """Make the node."""
        super().open(session)
        self._panel = RobotPanel(self.node)
        self.can_stand = not self.node.made_with["driver"]
        self.stamp = lambda: self.node.commander.gate.arrived

    def named_files(self) -> list[Path]:
        """The robot's configuration."""
        return [self.node.config.path]

    def close(self) -> None:
        """Close the node; again is no error."""
        self.node.close()

    def ready_note(self) -> str:
        """What there is to say of a node that takes no commands yet."""
        return "" if self.node.commander.is_enabled else ", takes no commands until /io_teleop/set_enabled says so"

    def reset(self) -> None:
        """Bring the robot home."""
        self.node.bus.call(_RESET, TriggerRequest(), node="/page")

    def end(self, _session: SessionState, _result: SessionResult) -> None:
        """The run is over: a real robot is let go of at once."""
        if self.node.made_with["driver"]:
            self.node.close()
        self.node.bus.refusals.flush()

    def refused(self) -> dict[str, str]:
        """Actions on its time that are refused, and why: that of a real robot passes as it does."""
        if self.node.made_with["driver"]:
            return dict.fromkeys(("pause", "resume", "step", "speed"), "a real robot keeps real time")
        if not self.node.made_with["sim_time"]:
            return {"speed": "messages carry the wall clock's time: --sim-time lets it go at another speed"}
        return {}

    def panel(self, asked: dict[str, Any]) -> dict[str, Any]:
        """What a panel shows, as JSON values."""
        return self._panel.tell(asked)

    def ros_parameters(self) -> dict[str, Any]:
        """What belongs on the parameter server of ROS 1."""
        assert self.identity is not None
        text = urdf_text(self.node.config)
        return dict(ros_parameters(text, node=self.identity.node, sim_time=self.identity.tells_time))

    def film(self, options: VideoOptions, *, waits: bool, report: Callable[[str], None]) -> Filming:
        """A video of the robot, which is seen whole as it stands now, with the time in its corner."""
        from cellwright.viewer.filming import Filming

        node = self.node
        model, data = node.simulation.model, node.simulation.data
        heading = robot_heading(node.world, data) + TURN
        camera = options.camera or camera_on(model, data, heading, TILT, options.width, options.height)
        return Filming(
            node,
            options,
            camera=camera,
            caption=lambda: f"{node.simulation.time:.1f} s",
            waits=waits,
            warn=report,
            lamp=robot_lamp(camera),
        )

    def header(self, _session: SessionState, record: RecordOptions) -> RecordingHeader:
        """What the node was made with."""
        facts = {**common_facts(record), **self.node.made_with, **source_facts(record)}
        return RecordingHeader("robot", self.node.name, facts)


@dataclass(frozen=True)
class RobotWindow:
    """MuJoCo's window on a robot: an observer that has it open while a session runs.

    Attributes:
        sliders: with a slider for each joint in it.
        snapshot: file for a picture of how the robot stands at the end.
    """

    is_shown: bool = True
    sliders: bool = False
    snapshot: Path | None = None

    @contextmanager
    def __call__(self, session: SessionState) -> Iterator[None]:
        """Have the window open.

        Raises:
            WindowError: there can be none.
        """
        node, server = session.node, session.server
        if not self.is_shown or server is None:
            yield
            return
        RobotServices(node).offer_state(server)
        window = Window(node.world.model, reachable_address(server.address), sliders=self.sliders)
        try:
            yield
        finally:
            window.close()

    def save(self, node: RobotNode, progress: Progress | None = None) -> None:
        """Write the picture, if one is wanted; it takes some seconds.

        Raises:
            UsageError: it cannot be written.
        """
        if self.snapshot is not None:
            save_robot_picture(self.snapshot, node.world, node.simulation.data, progress=progress)


def urdf_text(config: RobotConfig) -> str:
    """The text of a robot's URDF, for programs elsewhere; empty where there is none to be read."""
    try:
        return with_absolute_meshes(read_text(config.urdf_path), config.urdf_path)
    except DescriptionError:  # a robot that was made in memory has none
        return ""
