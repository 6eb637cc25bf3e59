"""The arm of 2017, a UR10 on a rail: its names, limits and control settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

ARM_JOINTS = (
    "linear_arm_actuator_joint",
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
"""The arm's joints in the order of its controller."""

RAIL_LIMIT = 2.1
"""Range of the arm's rail to either side [m]."""

TURN_LIMIT = 6.283185307179586
"""Range of each of the arm's other joints to either side [rad]."""

ARM_FRAMES = (
    "linear_arm_actuator",
    "base_link",
    "shoulder_link",
    "upper_arm_link",
    "forearm_link",
    "wrist_1_link",
    "wrist_2_link",
    "wrist_3_link",
    "vacuum_gripper_link",
)
"""Links of the arm that sensors can be mounted on, from the rail to the tool."""

ServoProfile: TypeAlias = Literal["original", "precise"]


@dataclass(frozen=True, slots=True)
class JointGains:
    """PID gains of one joint's servo: force = p (q* - q) + d (qd* - qd) + i integral, the integral clamped."""

    p: float
    d: float
    i: float = 0.0
    i_clamp: float = 0.0


@dataclass(frozen=True, slots=True)
class JointTolerance:
    """Tolerances of one joint for trajectory goals, in rad or m; 0 means not checked."""

    trajectory: float = 0.1
    goal: float = 0.1


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """Control settings of the arm, in the form of the original's controller file.

    Gains not named keep the profile's. `dry_friction` is in N for the rail and N m for the other joints; joints not
    named have none.
    """

    servo: ServoProfile = "original"
    gains: Mapping[str, JointGains] = field(default_factory=dict)
    dry_friction: Mapping[str, float] = field(default_factory=dict)
    tolerances: Mapping[str, JointTolerance] = field(default_factory=dict)
    goal_time: float = 0.6
    stopped_velocity_tolerance: float = 0.05
    stop_trajectory_duration: float = 0.5
    allow_partial_joints_goal: bool = False
