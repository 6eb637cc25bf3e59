"""Short programs that work the bundled tasks of the humanoid over its own topics."""

import math
from collections.abc import Mapping

from cellwright import Client, Pose
from cellwright.middleware.messages.conversions import header, joint_state, pose_from_message, pose_message
from cellwright.middleware.messages.standard import PoseArray
from cellwright.util.pose import Vector3

BASE = Pose((0.0, 0.0, 1.16))
"""The robot's base in the world; its hands go to poses in this frame."""
RIGHT, LEFT = 0, 1


class Hands:
    """Hands of the humanoid: they go to points of the world, turned as at home, and close."""

    def __init__(self, client: Client) -> None:
        self._client, self._status = client, [0.0, 0.0]
        self._tips = client.latest("/io_teleop/state_ee_poses")
        client.wait_until(lambda: self._tips.message is not None, 1.0)
        self._poses = self._now()

    def _now(self) -> list[Pose]:
        return [pose_from_message(tip) for tip in self._tips.message.poses]

    def go(self, points: Mapping[int, Vector3]) -> None:
        """Bring hands to points of the world [m]."""
        for hand, point in points.items():
            self._poses[hand] = Pose(BASE.inverse().transform(point), self._poses[hand].quaternion)
        message = PoseArray(header(), [pose_message(each) for each in self._poses])
        self._client.publish("/io_teleop/target_ee_poses", message)
        self._client.wait_until(
            lambda: all(math.dist(self._now()[each].position, self._poses[each].position) < 0.004 for each in points),
            4.0,
        )

    def close(self, hand: int, status: float) -> None:
        """Close a hand from 0 (open) to 1."""
        self._status[hand] = status
        self._client.publish("/io_teleop/target_gripper_status", joint_state(["", ""], self._status, time=0))


class Reacher:
    """Brings both hands to the points of the bundled tasks."""

    def run(self, client: Client) -> None:
        """Reach, and stay."""
        Hands(client).go({RIGHT: (0.4, -0.05, 1.1), LEFT: (0.4, 0.2, 1.45)})
        client.sleep(1.0)


class Giver:
    """Takes the gear with the right hand, holds it before the chest, and lets go as the left hand closes."""

    def run(self, client: Client) -> None:
        """Hand the gear over."""
        hands = Hands(client)
        hands.go({RIGHT: (0.42, -0.24, 1.2)})
        hands.go({RIGHT: (0.42, -0.24, 1.06)})
        hands.close(RIGHT, 1.0)
        client.sleep(0.5)
        hands.go({RIGHT: (0.42, -0.12, 1.25)})
        hands.go({RIGHT: (0.42, -0.03, 1.25), LEFT: (0.42, 0.03, 1.25)})
        hands.close(RIGHT, 0.0)
        hands.close(LEFT, 1.0)
        client.sleep(1.0)
