"""The ROS 1 side of a robot's node, as the command line starts it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.mesh_references import with_absolute_meshes
from cellwright.config.robot.urdf_file import read_text
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.ros1.host.identity import Identity
from cellwright.middleware.server import Server
from cellwright.robot.interface.parameters import parameters
from cellwright.util.errors import DescriptionError


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
        told = parameters(urdf_text(config), node=self.identity.node, sim_time=self.identity.tells_time)
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
