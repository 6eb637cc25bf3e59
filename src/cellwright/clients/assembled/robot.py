"""Assembled robot: base, arms, grippers, head and lift as programs of the io_teleop stack drive them."""

from __future__ import annotations

import os
import sys
from typing import Any, Mapping, Sequence

from cellwright.clients.assembled import process as services
from cellwright.clients.assembled.joints import Indices, JointStates, Lookup, Numbers, Pose, RobotJoints, index_table
from cellwright.clients.assembled.process import RobotProcess
from cellwright.clients.assembled.pybullet_calls import RobotId, answer_in_pybullet
from cellwright.util.errors import UsageError

ROOT = -1
"""Index of the root link."""


def pose_lists(pose: Pose) -> list[list[float]]:
    """Return a pose as plain lists, from sequences of any type.

    Raises:
        UsageError: it is not a pose.
    """
    try:
        position, orientation = ([float(value) for value in part] for part in pose)
    except (TypeError, ValueError):
        position, orientation = [], []
    if len(position) != 3 or len(orientation) != 4:
        raise UsageError("a pose is [[x, y, z], [qx, qy, qz, qw]]")
    return [position, orientation]


class RobotBase:
    """The root link."""

    def __init__(self, process: RobotProcess, joints: RobotJoints) -> None:
        self._process = process
        self._joints = joints

    @property
    def pose(self) -> Pose:
        """Pose in the world, from the configuration at first; the original ignored the pose of its configuration."""
        return self._joints.link_poses([ROOT])[0]

    def reset_base(self, pose: Pose) -> None:
        """Put the root link at a pose in the world at once, with the whole robot."""
        self._process.ask(services.PLACE_BASE_SERVICE, pose=pose_lists(pose))


class RobotArm:
    """An arm.

    Attributes:
        arm_joint_index: indices of its joints.
        ee_index: index of the link at its tip.
        home_j_pos: its home posture [rad; m].
        home_ee_pose: pose of the tip in the world after loading.
    """

    def __init__(self, process: RobotProcess, joints: RobotJoints, number: int, described: Mapping[str, Any]) -> None:
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
        """Pose of its tip in the world."""
        return self._joints.link_poses([self.ee_index])[0]

    @property
    def rel_ee_pose(self) -> Pose:
        """Pose of its tip in the frame of the root link."""
        return self._joints.link_poses([self.ee_index], frame=ROOT)[0]

    def move_ee(self, pose: Pose) -> None:
        """Move the link that `controller_indices.cmd_ee` names, usually the tip, to a pose in the world.

        The link comes as near to the pose as the limits of joints and speeds allow; the base is assumed to stay in
        place.
        """
        self._process.ask(services.MOVE_TIP_SERVICE, arm=self._number, pose=pose_lists(pose))


class RobotGripper:
    """A gripper or hand: 0 is open, each of its joints at one of its limits, and 1 closed, at the other one.

    The configuration says which limit is which; by default the lower one is open. Joints that mimic others move with
    these, and do not count for the closed share.

    Attributes:
        finger_index: indices of its joints.
        joint_range: limits of each [rad; m].
    """

    def __init__(self, joints: RobotJoints, described: Mapping[str, Any]) -> None:
        self._joints = joints
        self.finger_index: list[int] = list(described["joints"])
        self._follows: list[bool] = list(described["follows"])  # which of them mimic others
        self.joint_range = [list(joints.range_of(index)) for index in self.finger_index]
        self._ends: list[list[float]] = [list(ends) for ends in described["ways"]]  # of each joint: open, closed

    @property
    def joint_pos(self) -> list[float]:
        """Positions of its joints [rad; m]."""
        return self._joints.positions(self.finger_index)

    @property
    def status(self) -> float:
        """Closed share, from 0 to 1."""
        fingers = [each for each, follows in zip(zip(self.joint_pos, self._ends), self._follows) if not follows]
        moved = sum((place - begin) * (1.0 if end > begin else -1.0) for place, (begin, end) in fingers)
        whole = sum(abs(end - begin) for _, (begin, end) in fingers)
        return min(max(moved / whole, 0.0), 1.0) if whole > 0.0 else 0.0

    def joint_pos_from_status(self, status: float) -> list[float]:
        """Return the positions of its joints [rad; m] at a closed share; values beyond 0 and 1 are clamped."""
        part = min(max(float(status), 0.0), 1.0)
        return [begin + part * (end - begin) for begin, end in self._ends]

    def move(self, status: float) -> None:
        """Move to a closed share: 0 is open, 1 closed."""
        self._joints.move(self.finger_index, self.joint_pos_from_status(status))

    def reset(self, status: float = 0.0) -> None:
        """Put the gripper at a closed share at once: 0 is open, 1 closed."""
        self._joints.place(self.finger_index, self.joint_pos_from_status(status))


class RobotHead:
    """A head.

    Attributes:
        head_joint_index: indices of its joints: those of roll, pitch and yaw that it has.
        home_j_pos: their home posture [rad].
    """

    def __init__(self, joints: RobotJoints, described: Mapping[str, Any]) -> None:
        self._joints = joints
        self._axes: list[int] = list(described["axes"])
        self.head_joint_index: list[int] = list(described["joints"])
        self.home_j_pos: list[float] = list(described["home"])

    @property
    def rotation(self) -> list[float]:
        """Roll, pitch and yaw [rad]; 0 for an axis that it has not."""
        found = [0.0, 0.0, 0.0]
        for axis, position in zip(self._axes, self._joints.positions(self.head_joint_index)):
            found[axis] = position
        return found

    def move(self, rotation: Sequence[float]) -> None:
        """Turn to roll, pitch and yaw [rad]; axes that it has not are ignored.

        Raises:
            UsageError: not three numbers.
        """
        if len(rotation) != 3:
            raise UsageError(f"a head rotation is roll, pitch and yaw: three numbers (got {len(rotation)})")
        self._joints.move(self.head_joint_index, [rotation[axis] for axis in self._axes])

    def reset(self) -> None:
        """Move home."""
        self._joints.move(self.head_joint_index, self.home_j_pos)


class RobotDorsal:
    """The lift of the torso.

    Attributes:
        dorsal_lift_joint_index: index of its joint.
        home_j_pos: its home position [m; rad].
    """

    def __init__(self, joints: RobotJoints, described: Mapping[str, Any]) -> None:
        self._joints = joints
        (self.dorsal_lift_joint_index,) = described["joints"]
        (self.home_j_pos,) = described["home"]

    @property
    def height(self) -> float:
        """Present height [m; rad]."""
        return self._joints.positions([self.dorsal_lift_joint_index])[0]

    def move(self, height: float) -> None:
        """Move to a height [m; rad]."""
        self._joints.move(self.dorsal_lift_joint_index, height)

    def reset(self) -> None:
        """Move home."""
        self.move(self.home_j_pos)


class AssembledRobot:
    """A robot, loaded from its configuration, that moves in real time in a process of its own.

    A subclass adds topics, and calls this class from the callbacks of its subscribers: every method may be called from
    any thread. Joints and links go by index (`cellwright robot FILE` prints the table). A configured robot has `arms`,
    right and left. It has `grippers`, `head` and `dorsal` only where they are configured: check with `hasattr`.

    Args:
        robot_urdf_path: the URDF.
        configs: the robot configuration (`vr_configs.yml`) as `yaml.safe_load` returns it.
        debug: print the index table, and open a window in which sliders move the joints.
        with_ee_constraint: kept as an attribute; `arms[].move_ee` exists in any case.
        physics_clent_id: of the original's engine (and spelt as there); kept as an attribute.

    Attributes:
        robot_id: the robot in calls of PyBullet. Of a program's PyBullet, `getNumJoints`, `getJointInfo` and
            `getJointState` answer for it; all others raise an error that says what to use.
        joint_name2id_dict: index of each joint, fixed ones included.
        joint_id2name_dict: name of each joint.
        link_name2id_dict: index of each link but the root, which is -1.
        base: the root link.
        arms: as configured.
        address: host and port of the robot's own node, with all topics of `cellwright teleop`.

    Raises:
        UsageError: the robot cannot be loaded; the text says what is wrong.

    Example:
        >>> import yaml
        >>> from cellwright import AssembledRobot
        >>> from cellwright.config.robot.robots import find_robot
        >>> file = find_robot("tandem")
        >>> configs = yaml.safe_load(file.read_text())
        >>> robot = AssembledRobot(file.parent / configs["urdf_path"], configs)
        >>> robot.reset_j(robot.joint_name2id_dict["lift"], 0.25)
        >>> round(robot.joint_states().positions[0], 3)
        0.25
        >>> robot.close()
    """

    python = sys.executable
    """The interpreter of Cellwright's installation; under another one a subclass must set it."""

    without_gui: bool | None = None
    """False, in the class or before `__init__`, opens MuJoCo's window. None takes the configuration's entry of this
    name, and opens no window where there is none.
    """

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
        self._joints = RobotJoints(self._process, described)
        joints = self._joints
        self.robot_id = RobotId(joints)
        answer_in_pybullet()
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
        """Move joints to positions [rad; m], one for each index, clamped to their limits.

        `max_vel` and `force` have no effect, as in the original: both are limited as the URDF says.

        Raises:
            UsageError: there is no such joint, or a number is not finite; then none of them moves.
        """
        self._joints.move(idx, pos)

    def reset_j(self, idx: Indices, pos: Numbers) -> None:
        """Put joints at positions [rad; m], clamped to their limits, at once and at rest.

        Raises:
            UsageError: as for `move_j`.
        """
        self._joints.place(idx, pos)

    def reset_home(self) -> None:
        """Move arms, waist, head and lift home, and open the grippers at once."""
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
        """Return the state of all joints that are not fixed, in the order of their indices."""
        return self._joints.states()

    def link_pose(self, idx: int = ROOT) -> list[list[float]]:
        """Return the pose of a link in the world, [[x, y, z], [qx, qy, qz, qw]]; of the root link by default."""
        return [list(each) for each in self._joints.link_poses([idx])[0]]

    @property
    def is_running(self) -> bool:
        """True while the robot can be reached; False after `close`, or when its process has ended."""
        return self._process.is_running

    def close(self) -> None:
        """End the robot's process; the end of this program does so too."""
        self._process.close()
