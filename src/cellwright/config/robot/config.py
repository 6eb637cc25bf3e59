"""Robot configuration (`vr_configs.yml`) as checked values: joints and links by name, groups in the order given."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any

from cellwright.config.robot.model import Joint, RobotModel, position_of
from cellwright.util.pose import Pose

UNUSED: Mapping[str, str] = {
    "vibration_thresholds": "thresholds for the vibration of the operator's controllers",
    "robot_scale": "scale of the operator's motion",
    "arm_pos_scale": "scale of the operator's motion",
    "dorsal_move_scale": "scale of the operator's sticks",
    "base_move_scale": "scale of the operator's sticks",
    "base_move_filter": "smoothing of the operator's sticks",
    "base_max_acc_per_step": "smoothing of the operator's sticks",
    "base_max_dec_per_step": "smoothing of the operator's sticks",
    "ee_wrt_head": "measurement of the operator's hands relative to the head",
    "non_fixed_joint_ids": "list of joints, unused in all revisions",
    "finger_command_topics": "names of topics; the names in the contract are used",
    "without_gui": "switch for the window; here the option `--gui`",
    "sim_camera": "initial view of the original's window",
    "sim_opengl2": "renderer of the original's window",
}
"""Entries that are known but unused, each with its purpose."""


class BaseMode(StrEnum):
    """Meaning of the numbers in a command of the base."""

    ORIGINAL = "original"
    """Turn [rad], and move along the base's own y axis [m], by the given amounts."""
    DELTA = "delta"
    """Turn [rad], and move along its own x and y axes [m], by the given amounts."""
    VELOCITY = "velocity"
    """Turn [rad/s], and move along its own x and y axes [m/s], at these speeds, until the next command or for 0.2 s."""


@dataclass(frozen=True, slots=True)
class ArmConfig:
    """Arm: its joints, the link at its tip whose pose is commanded, and its home posture [rad; m]."""

    joints: tuple[str, ...]
    tip: str
    home: tuple[float, ...]


class RangeEnd(StrEnum):
    """End of a joint's range."""

    LOWER = "lower"
    UPPER = "upper"


@dataclass(frozen=True, slots=True)
class GripperConfig:
    """Gripper or hand: status 0 (open) is one limit of each of its joints, 1 (closed) the other one.

    Attributes:
        joints: its joints.
        open_ends: the limits at which its joints are open; empty if that is the lower one for all.
    """

    joints: tuple[str, ...]
    open_ends: tuple[RangeEnd, ...] = ()

    def open_and_closed(self, joint: Joint) -> tuple[float, float]:
        """Return the open and the closed position of one of its joints [rad; m]."""
        lower, upper = joint.limits.lower, joint.limits.upper
        opens_up = bool(self.open_ends) and self.open_ends[self.joints.index(joint.name)] is RangeEnd.UPPER
        return (upper, lower) if opens_up else (lower, upper)


@dataclass(frozen=True, slots=True)
class Posture:
    """Joints with their home positions [rad; m]: head, waist, lift."""

    joints: tuple[str, ...]
    home: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class CameraConfig:
    """Camera as the file describes it, by its own keys."""

    name: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class RobotConfig:
    """Robot and its configuration.

    Attributes:
        path: the configuration file, or the URDF if there is none.
        base_pose: world_T_root as loaded; world_T_fixed_link if there is a fixed link.
        fixed_link: the link that is fixed to the world instead of the root; None for the root.
        arms: right, left; one or more.
        grippers: right, left; as many as the robot has.
        head: roll, pitch, yaw, without those that the robot lacks.
        head_axes: axes of the joints of the head: 0 roll, 1 pitch, 2 yaw.
        dorsal: the lift of the torso.
        command_links: tip of each arm, that `target_ee_poses` commands.
        reference_links: the link in whose frame each of these poses is given; None: the robot's base.
        max_accelerations: maximum acceleration of the targets of joints [rad/s^2; m/s^2], by joint; others are not
            bounded.
        xacro_arguments: arguments of the URDF, if it is a xacro file.
        others: entries kept as written: `base_command_mode`, which the base reads, and known but unused ones
            (thresholds and scales of the headset's side).
    """

    robot: RobotModel
    name: str
    path: Path
    urdf_path: Path
    base_pose: Pose = field(default_factory=Pose)
    fixed_link: str | None = None
    arms: tuple[ArmConfig, ...] = ()
    grippers: tuple[GripperConfig, ...] = ()
    head: Posture | None = None
    head_axes: tuple[int, ...] = ()
    dorsal: Posture | None = None
    waist: Posture | None = None
    command_links: tuple[str, ...] = ()
    reference_links: tuple[str | None, ...] = ()
    cameras: tuple[CameraConfig, ...] = ()
    max_accelerations: Mapping[str, float] = field(default_factory=dict)
    xacro_arguments: Mapping[str, str] = field(default_factory=dict)
    others: Mapping[str, Any] = field(default_factory=dict)

    @property
    def start(self) -> dict[str, float]:
        """Return the initial posture [rad; m], by joint: arms at home, all else at 0."""
        return {name: value for arm in self.arms for name, value in zip(arm.joints, arm.home, strict=True)}

    @property
    def hand_links(self) -> tuple[str, ...]:
        """Return the links that the last joint of an arm carries: its wrist, hand and fingers."""
        last = {arm.joints[-1] for arm in self.arms if arm.joints}
        robot = self.robot
        return tuple(link for link in robot.links if any(joint.name in last for joint in robot.chain(link)))

    @property
    def home(self) -> dict[str, float]:
        """Return the posture of a reset [rad; m], by joint: arms, waist, head and lift as configured, grippers open.

        It leaves out joints that mimic another, since that joint determines their positions.
        """
        found = self.start
        for group in (self.waist, self.head, self.dorsal):
            if group is not None:
                found |= dict(zip(group.joints, group.home, strict=True))
        for gripper in self.grippers:
            joints = [self.robot.joint(name) for name in gripper.joints]
            found |= {joint.name: gripper.open_and_closed(joint)[0] for joint in joints if joint.mimic is None}
        return found


def initial_posture(config: RobotConfig, start: Mapping[str, float] = MappingProxyType({})) -> dict[str, float]:
    """Return the posture in which a run begins [rad; m], by joint; joints in `start` begin there.

    A joint that cannot be at 0 starts at the nearest limit. The original puts it at 0 all the same, and the first
    command makes it jump. Mimic joints start where they follow their leader.
    """
    robot, positions = config.robot, {**config.start, **start}
    leaders_first = sorted(robot.driven, key=lambda joint: joint.mimic is not None)
    for joint in leaders_first:
        if joint.name not in positions:
            place = position_of(robot, joint, positions)
            positions[joint.name] = min(max(place, joint.limits.lower), joint.limits.upper)
    return positions
