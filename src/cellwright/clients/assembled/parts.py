"""The parts of an assembled robot: base, arms, grippers, head, lift. What they tell is as it is at that moment."""

from __future__ import annotations

from typing import Any, Mapping, Sequence

from cellwright.clients.assembled import services
from cellwright.clients.assembled.joints import Joints, Pose
from cellwright.clients.assembled.poses import as_numbers, inverted, multiplied
from cellwright.clients.assembled.process import RobotProcess
from cellwright.util.errors import UsageError

ROOT = -1
"""Index of the root link."""


class RobotBase:
    """The root link.

    Args:
        process: where the robot moves.
        joints: of the robot.
    """

    def __init__(self, process: RobotProcess, joints: Joints) -> None:
        self._process = process
        self._joints = joints

    @property
    def pose(self) -> Pose:
        """Where it is in the world; the original forgot the pose that the configuration loads the robot at."""
        return self._joints.link_poses([ROOT])[0]

    def reset_base(self, pose: Pose) -> None:
        """Put it at a pose in the world at once; the robot comes along."""
        self._process.ask(services.PLACE_BASE, pose=as_numbers(pose))


class RobotArm:
    """An arm.

    Attributes:
        arm_joint_index: indices of its joints.
        ee_index: index of the link at its tip.
        home_j_pos: its home posture [rad; m].
        home_ee_pose: where the tip is in the world when the robot is put up.
    """

    def __init__(self, process: RobotProcess, joints: Joints, number: int, described: Mapping[str, Any]) -> None:
        self._process = process
        self._joints = joints
        self._number = number
        self.arm_joint_index: list[int] = list(described["joints"])
        self.ee_index: int = described["tip"]
        self.home_j_pos: list[float] = list(described["home"])
        self.home_ee_pose: Pose = described["home_pose"]

    @property
    def joint_pos(self) -> list[float]:
        """Positions of its joints [rad; m]."""
        return self._joints.positions(self.arm_joint_index)

    @property
    def abs_ee_pose(self) -> Pose:
        """Where its tip is in the world."""
        return self._joints.link_poses([self.ee_index])[0]

    @property
    def rel_ee_pose(self) -> Pose:
        """Where its tip is in the frame of the root link."""
        tip, root = self._joints.link_poses([self.ee_index, ROOT])
        return multiplied(inverted(root), tip)

    def move_ee(self, pose: Pose) -> None:
        """Bring the link that `controller_indices.cmd_ee` names, the tip as a rule, to a pose in the world.

        As near as it can be reached, within the limits of joints and speeds; the base is taken to stay where it is.
        """
        self._process.ask(services.MOVE_TIP, arm=self._number, pose=as_numbers(pose))


class RobotGripper:
    """A gripper or hand: 0 is open, each of its joints at one of its limits, and 1 closed, at the other one.

    The configuration says which is which; open is the lower limit where it does not. Joints that mimic others go with
    these, wherever that is, and have no part in how far it is closed.

    Attributes:
        finger_index: indices of its joints.
        joint_range: limits of each [rad; m].
    """

    def __init__(self, joints: Joints, described: Mapping[str, Any]) -> None:
        self._joints = joints
        self.finger_index: list[int] = list(described["joints"])
        self._follows: list[bool] = list(described["follows"])  # which of them mimic others
        self.joint_range = [list(joints.range_of(index)) for index in self.finger_index]
        self._ways: list[list[float]] = [list(way) for way in described["ways"]]  # where each is open, and closed

    @property
    def joint_pos(self) -> list[float]:
        """Positions of its joints [rad; m]."""
        return self._joints.positions(self.finger_index)

    @property
    def status(self) -> float:
        """How far it is closed, from 0 to 1."""
        fingers = [each for each, follows in zip(zip(self.joint_pos, self._ways), self._follows) if not follows]
        way = sum((place - begin) * (1.0 if end > begin else -1.0) for place, (begin, end) in fingers)
        whole = sum(abs(end - begin) for _, (begin, end) in fingers)
        return min(max(way / whole, 0.0), 1.0) if whole > 0.0 else 0.0

    def joint_pos_from_status(self, status: float) -> list[float]:
        """Positions of its joints [rad; m] when it is closed so far; what is beyond 0 or 1 counts as 0 or 1."""
        part = min(max(float(status), 0.0), 1.0)
        return [begin + part * (end - begin) for begin, end in self._ways]

    def move(self, status: float) -> None:
        """Close it so far: 0 is open, 1 closed."""
        self._joints.move(self.finger_index, self.joint_pos_from_status(status))

    def reset(self, status: float = 0.0) -> None:
        """Have it closed so far at once: 0 is open, 1 closed."""
        self._joints.place(self.finger_index, self.joint_pos_from_status(status))


class RobotHead:
    """A head.

    Attributes:
        head_joint_index: indices of its joints, of roll, pitch and yaw those that it has.
        home_j_pos: their home posture [rad].
    """

    def __init__(self, joints: Joints, described: Mapping[str, Any]) -> None:
        self._joints = joints
        self._axes: list[int] = list(described["axes"])
        self.head_joint_index: list[int] = list(described["joints"])
        self.home_j_pos: list[float] = list(described["home"])

    @property
    def rotation(self) -> list[float]:
        """Roll, pitch and yaw [rad]; 0 for what it cannot do."""
        found = [0.0, 0.0, 0.0]
        for axis, position in zip(self._axes, self._joints.positions(self.head_joint_index)):
            found[axis] = position
        return found

    def move(self, rotation: Sequence[float]) -> None:
        """Turn it to roll, pitch and yaw [rad]; what it cannot do is left out.

        Raises:
            UsageError: not three numbers.
        """
        if len(rotation) != 3:
            raise UsageError(f"a head is turned by roll, pitch and yaw, three numbers, not {len(rotation)}")
        self._joints.move(self.head_joint_index, [rotation[axis] for axis in self._axes])

    def reset(self) -> None:
        """Have it go home."""
        self._joints.move(self.head_joint_index, self.home_j_pos)


class RobotDorsal:
    """The lift of the torso.

    Attributes:
        dorsal_lift_joint_index: index of its joint.
        home_j_pos: where it is at home [m; rad].
    """

    def __init__(self, joints: Joints, described: Mapping[str, Any]) -> None:
        self._joints = joints
        (self.dorsal_lift_joint_index,) = described["joints"]
        (self.home_j_pos,) = described["home"]

    @property
    def height(self) -> float:
        """Where it is [m; rad]."""
        return self._joints.positions([self.dorsal_lift_joint_index])[0]

    def move(self, height: float) -> None:
        """Have it go to a height [m; rad]."""
        self._joints.move(self.dorsal_lift_joint_index, height)

    def reset(self) -> None:
        """Have it go home."""
        self.move(self.home_j_pos)
