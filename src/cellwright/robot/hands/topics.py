"""The topics of the tips' poses: messages made into targets, and the tips' poses made into messages."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.sampling import Sampled
from cellwright.middleware.interface.table import Row
from cellwright.middleware.messages.build import header, nanoseconds, pose_message
from cellwright.middleware.messages.standard import Pose as PoseMessage
from cellwright.middleware.messages.standard import PoseArray
from cellwright.robot.commander import Commander
from cellwright.robot.hands.poses import TOPIC, EePoses
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose

FARTHEST = 1000.0
"""Farther away than this [m] a pose is taken for a mistake."""
SHORTEST = 1e-6
"""A quaternion shorter than this has no direction."""


class EePoseTopics:
    """What `/io_teleop/target_ee_poses` means, and what `/io_teleop/state_ee_poses` says.

    Args:
        config: the robot.
        commander: decides whether a command is taken.
        ee_poses: knows where the tips are, and in which frames poses are given.
        told: the time that messages carry [ns].
    """

    def __init__(self, config: RobotConfig, commander: Commander, ee_poses: EePoses, told: Callable[[], int]) -> None:
        self._links = config.robot.link_indices
        self._commander, self._ee_poses, self._told = commander, ee_poses, told
        references = set(ee_poses.references)
        self._frame = references.pop() if len(references) == 1 else ""

    def serve(self, bus: Bus, simulation: Simulation, table: tuple[Row, ...]) -> None:
        """Take a place on the bus, where the robot has arms."""
        for rank, row in enumerate(table, 1):
            if row.name == TOPIC:
                bus.listen(row.name, row.type, self._command, node=row.node)
            elif row.name == "/io_teleop/state_ee_poses":
                Sampled(bus, simulation, row, row.period, self.state, rank=rank)

    def _command(self, message: Any, node: str) -> None:
        poses = self.targets(message)

        def act() -> bool:
            self._ee_poses.aim(poses)
            return True

        self._commander.take(TOPIC, node, nanoseconds(message.header.stamp), act)

    def targets(self, message: PoseArray) -> list[Pose]:
        """The poses of a message, reference_T_tip for each arm.

        A `frame_id` that is the name of a link of the robot is the frame of the poses, as that link stands now; any
        other, also the empty one, says nothing: each pose is given in the frame of its arm's reference.

        Raises:
            RejectedCommandError: the message has not a pose for each arm, or one that means nothing.
        """
        count = len(self._ee_poses.references)
        if len(message.poses) != count:
            needed = "1 pose is needed" if count == 1 else f"{count} poses are needed (right, left)"
            raise RejectedCommandError(f"{needed}, not {len(message.poses)}")
        poses = [_pose(each, f"poses[{place}]") for place, each in enumerate(message.poses)]
        frame = message.header.frame_id
        if frame in self._links:
            poses = [there @ pose for there, pose in zip(self._ee_poses.frames(frame), poses, strict=True)]
        return poses

    def state(self) -> PoseArray:
        """Where the tips are."""
        return PoseArray(header(self._frame, self._told()), [pose_message(pose) for pose in self._ee_poses.poses()])


def _pose(message: PoseMessage, where: str) -> Pose:
    """The pose in a message; its quaternion scaled to unit length.

    Raises:
        RejectedCommandError: it is not finite, too far away, or has no direction.
    """
    p, q = message.position, message.orientation
    numbers = (p.x, p.y, p.z, q.w, q.x, q.y, q.z)
    length = math.hypot(*numbers[3:])
    if not all(map(math.isfinite, (*numbers, length))):
        raise RejectedCommandError(f"{where} must be finite")
    if math.hypot(*numbers[:3]) > FARTHEST:
        raise RejectedCommandError(f"{where}.position must be within {FARTHEST:g} m")
    if length < SHORTEST:
        raise RejectedCommandError(f"{where}.orientation must be a quaternion (x, y, z, w), not all zeros")
    return Pose((p.x, p.y, p.z), (q.w / length, q.x / length, q.y / length, q.z / length))
