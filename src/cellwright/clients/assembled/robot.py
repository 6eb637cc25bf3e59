"""Assembled robot: base, arms, grippers, head and lift as programs of the io_teleop stack drive them."""

from __future__ import annotations

import os
import sys
from typing import Any, Mapping, Sequence

from cellwright.clients.assembled import process as services
from cellwright.clients.assembled.joints import Indices, Joints, JointStates, Lookup, Numbers, Pose, index_table
from cellwright.clients.assembled.process import RobotProcess
from cellwright.util.errors import UsageError


def pose_lists(pose: Pose) -> list[list[float]]:
    """A pose as plain lists, whatever sequences it is made of; a UsageError if it is none."""
    try:
        position, orientation = ([float(value) for value in part] for part in pose)
    except (TypeError, ValueError):
        position, orientation = [], []
    if len(position) != 3 or len(orientation) != 4:
        raise UsageError("a pose is [[x, y, z], [qx, qy, qz, qw]]")
    return [position, orientation]


ROOT = -1
"""Index of the root link."""


class RobotBase:
    """The root link."""

    def __init__(self, process: RobotProcess, joints: Joints) -> None:
        self._process = process
        self._joints = joints

    @property
    def pose(self) -> Pose:
        """Where it is in the world; the original forgot the pose that the configuration loads the robot at."""
        return self._joints.link_poses([ROOT])[0]

    def reset_base(self, pose: Pose) -> None:
        """Put it at a pose in the world at once; the robot comes along."""
        self._process.ask(services.PLACE_BASE_SERVICE, pose=pose_lists(pose))


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
        return self._joints.link_poses([self.ee_index], frame=ROOT)[0]

    def move_ee(self, pose: Pose) -> None:
        """Bring the link that `controller_indices.cmd_ee` names, the tip as a rule, to a pose in the world.

        As near as it can be reached, within the limits of joints and speeds; the base is taken to stay where it is.
        """
        self._process.ask(services.MOVE_TIP_SERVICE, arm=self._number, pose=pose_lists(pose))


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

    `head_joint_index` are the indices of its joints, of roll, pitch and yaw those that it has, and `home_j_pos` their
    home posture [rad].
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
    """The lift of the torso: `dorsal_lift_joint_index` is the index of its joint, `home_j_pos` its home [m; rad]."""

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


class AssembledRobot:
    """A robot, put up as its configuration says, moving in real time in a process of its own.

    A subclass adds topics, and calls this class from the callbacks of its subscribers: every method may be called from
    any thread. Joints and links go by index (`cellwright robot FILE` prints the table). A configured robot has `arms`,
    right and left; `grippers`, `head` and `dorsal` are there only where they are configured: ask with `hasattr`.

    Args:
        robot_urdf_path: the URDF.
        configs: the robot configuration (`vr_configs.yml`) as `yaml.safe_load` has it.
        debug: print the index table, and open a window in which sliders move the joints.
        with_ee_constraint: kept as an attribute; `arms[].move_ee` is there in any case.
        physics_clent_id: of the original's engine (and spelt as there); kept as an attribute.

    Attributes:
        robot_id: always 0: there is one robot.
        joint_name2id_dict: index of each joint, fixed ones included.
        joint_id2name_dict: name of each joint.
        link_name2id_dict: index of each link but the root, which is -1.
        base: the root link.
        arms: as configured.
        address: host and port at which programs reach the robot's own node, with all topics of `cellwright teleop`.

    Raises:
        UsageError: the robot is not as it should be; the text says what is wrong.
    """

    python = sys.executable
    """The interpreter that Cellwright is installed for; under another one a subclass has to name it."""

    without_gui: bool | None = None
    """Set it to False, in the class or before `__init__`, to have MuJoCo's window opened; None: as the configuration's
    entry of this name says, and without a window where there is none."""

    def __init__(
        self,
        robot_urdf_path: str | os.PathLike[str],
        configs: Mapping[str, Any],
        debug: bool = False,  # noqa: FBT001 (called by position, as in the original)
        with_ee_constraint: bool = False,  # noqa: FBT001
        physics_clent_id: int = 0,
    ) -> None:
        self.configs = configs
        self.physics_clent_id = physics_clent_id
        self.with_ee_constraint = with_ee_constraint
        self.robot_id = 0
        if self.without_gui is None:
            self.without_gui = bool(configs.get("without_gui", True)) if isinstance(configs, dict) else True
        order = {
            "urdf": os.path.abspath(os.fspath(robot_urdf_path)),
            "configs": configs,
            "window": debug or not self.without_gui,
            "sliders": debug,
        }
        self._process = RobotProcess(self.python, order)
        self.address = self._process.address
        self._assemble(self._process.ask(services.DESCRIBE_SERVICE))
        if debug:
            sys.stdout.write(index_table(self._joints.table) + "\n")
            sys.stdout.flush()

    def _assemble(self, described: Mapping[str, Any]) -> None:
        self._joints = Joints(self._process, described)
        joints = self._joints
        names = {joint.name: joint.index for joint in joints.table}
        self.joint_name2id_dict: Lookup[int] = Lookup("joint", names)
        self.joint_id2name_dict: Lookup[str] = Lookup("joint index", {index: name for name, index in names.items()})
        self.link_name2id_dict: Lookup[int] = Lookup("link", {joint.link: joint.index for joint in joints.table})
        self.base = RobotBase(self._process, joints)
        self.arms = [RobotArm(self._process, joints, number, arm) for number, arm in enumerate(described["arms"])]
        waist = described["waist"] or {"joints": [], "home": []}
        self._waist = list(zip(waist["joints"], waist["home"]))
        if described["grippers"]:
            self.grippers = [RobotGripper(joints, gripper) for gripper in described["grippers"]]
        if described["head"] is not None:
            self.head = RobotHead(joints, described["head"])
        if described["dorsal"] is not None:
            self.dorsal = RobotDorsal(joints, described["dorsal"])

    def move_j(self, idx: Indices, pos: Numbers, max_vel: Sequence[float] = (), force: Sequence[float] = ()) -> None:  # noqa: ARG002
        """Have joints go to as many positions [rad; m], cut off at their limits.

        `max_vel` and `force` count for nothing, as in the original: both are limited as the URDF says.

        Raises:
            UsageError: there is no such joint, or a number is not finite; then none of them moves.
        """
        self._joints.move(idx, pos)

    def reset_j(self, idx: Indices, pos: Numbers) -> None:
        """Put joints at positions [rad; m], cut off at their limits, at once and at rest.

        Raises:
            UsageError: as for `move_j`.
        """
        self._joints.place(idx, pos)

    def reset_home(self) -> None:
        """Have arms, waist, head and lift go home, and open the grippers at once."""
        for arm in self.arms:
            self.move_j(arm.arm_joint_index, arm.home_j_pos)
        for index, position in self._waist:
            self.move_j(index, position)
        for part in ("head", "dorsal"):
            if hasattr(self, part):
                getattr(self, part).reset()
        for gripper in getattr(self, "grippers", ()):
            gripper.reset(0)

    def joint_states(self) -> JointStates:
        """All joints that are not fixed, in the order of their indices, as they are now."""
        return self._joints.states()

    def link_pose(self, idx: int = ROOT) -> list[list[float]]:
        """Where a link is in the world, [[x, y, z], [qx, qy, qz, qw]]; the root link when left out."""
        return [list(each) for each in self._joints.link_poses([idx])[0]]

    @property
    def is_running(self) -> bool:
        """Whether the robot can be spoken to; False after `close`, or when its process has ended."""
        return self._process.is_running

    def close(self) -> None:
        """End the robot's process. It ends by itself when this program does."""
        self._process.close()
