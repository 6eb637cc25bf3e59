"""Calls of PyBullet about an assembled robot, in programs that were written for the original's class.

The robot is not in PyBullet. Such a program reads its joints in a loop of `getNumJoints`, `getJointInfo` and
`getJointState`. In its PyBullet these three answer for an assembled robot as well; each other call about the robot
fails with what to use instead. Calls about other bodies are PyBullet's own.
"""

from __future__ import annotations

import sys
import time
from functools import wraps
from typing import Any, Callable

from cellwright.clients.assembled.joints import JointInfo, RobotJoints
from cellwright.util.errors import UsageError

TYPES = {"revolute": 0, "continuous": 0, "prismatic": 1, "spherical": 2, "planar": 3, "floating": 2, "fixed": 4}
"""PyBullet's numbers of the types of joints."""

_FRESH = 0.002  # [s]: a loop over all joints reads the robot once
_ATTRIBUTE = "_cellwright_original"


class RobotId:
    """The robot in place of the id of a body in PyBullet."""

    def __init__(self, joints: RobotJoints) -> None:
        self._joints = joints
        self._read = -_FRESH
        self._states: dict[int, tuple[float, float, None, float]] = {}

    def __index__(self) -> int:
        """Refuse to be the id of one of PyBullet's bodies; PyBullet asks for it in each call."""
        raise UsageError(
            "the robot is not in PyBullet, it moves in its own process; use self.joint_states(), self.link_pose(i), "
            "self.move_j(…) and self.reset_j(…) instead of calls with self.robot_id"
        )

    def number_of_joints(self) -> int:
        """Return the number of joints, fixed ones included."""
        return len(self._joints.table)

    def joint_info(self, index: int) -> tuple[Any, ...]:
        """Return PyBullet's description of a joint; None stands for entries that PyBullet alone knows."""
        joint = self._joint(index)
        return (
            *(joint.index, joint.name.encode(), TYPES[joint.type], None, None, None, None, None),
            *(joint.lower, joint.upper, joint.effort, joint.velocity, joint.link.encode(), None, None, None),
            self._joints.link_index(joint.parent),
        )

    def joint_state(self, index: int) -> tuple[float, float, None, float]:
        """Return position, velocity, None for the reaction forces, and effort; all 0 of a fixed joint."""
        joint = self._joint(index)
        if joint.type == "fixed":
            return 0.0, 0.0, None, 0.0
        now = time.monotonic()
        if now - self._read >= _FRESH:
            found = self._joints.states()
            rows = zip(found.positions, found.velocities, found.efforts)
            self._states = {
                each: (position, velocity, None, effort)
                for each, (position, velocity, effort) in zip(self._joints.movable, rows)
            }
            self._read = now
        return self._states[index]

    def _joint(self, index: int) -> JointInfo:
        count = len(self._joints.table)
        if not 0 <= index < count:
            raise UsageError(f"joint index {index!r}: must be from 0 to {count - 1}")
        return self._joints.table[index]


def answer_in_pybullet() -> None:
    """Let the program's PyBullet, if it has loaded one, answer the three calls about assembled robots."""
    module = sys.modules.get("pybullet")
    if module is None:
        return
    for name, answer in (
        ("getNumJoints", lambda body, *_rest, **_named: body.number_of_joints()),
        ("getJointInfo", _of_joint(RobotId.joint_info)),
        ("getJointState", _of_joint(RobotId.joint_state)),
    ):
        original = getattr(module, name, None)
        if original is not None and not hasattr(original, _ATTRIBUTE):
            setattr(module, name, _extended(original, answer))


def _of_joint(read: Callable[[RobotId, int], Any]) -> Callable[..., Any]:
    """Return a function with PyBullet's arguments that reads one joint."""

    def answer(body: RobotId, jointIndex: int, physicsClientId: int = 0) -> Any:  # noqa: ARG001 (PyBullet's names)
        return read(body, jointIndex)

    return answer


def _extended(original: Callable[..., Any], answer: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of PyBullet that answers for a `RobotId`, and is the original for all other bodies."""

    @wraps(original)
    def call(*arguments: Any, **named: Any) -> Any:
        body = arguments[0] if arguments else named.get("bodyUniqueId")
        if not isinstance(body, RobotId):
            return original(*arguments, **named)
        named.pop("bodyUniqueId", None)
        return answer(body, *arguments[1:], **named)

    setattr(call, _ATTRIBUTE, original)
    return call
