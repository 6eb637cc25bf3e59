"""The arm of 2017: a UR10 on a rail with a suction cup, as a robot's description and the figures of its drives.

Kinematics: Denavit-Hartenberg constants of the UR10 (CB3) [m], d1 .1273, a2 .612, a3 .5723, d4 .163941, d5 .1157,
d6 .0922. The frames are those of its public robot description, on a rail along the y axis of the rail's frame. A link
has the inertia of a solid cylinder, as in that description.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from cellwright.config.arm import ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT, JointGains
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel
from cellwright.util.pose import Pose, Vector3

RAIL = "linear_arm_actuator"
"""Link of the rail's beam, which stands in the cell."""

GRIPPER = "vacuum_gripper_link"
"""Link that holds the cup; its z axis points out of the back of the cup, up when the tool points down."""

GRIPPER_JOINT = "vacuum_gripper_joint"
"""Joint of the cup, which does not turn."""

INITIAL_POSITIONS: Mapping[str, float] = dict(zip(ARM_JOINTS, (0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0), strict=True))
"""Default initial joint positions [rad], [m]."""

WRIST_3_T_TOOL = {
    "ee_link": Pose.from_rpy((0.0, 0.0922, 0.0), (0.0, 0.0, math.pi / 2)),
    "tool0": Pose.from_rpy((0.0, 0.0922, 0.0), (-math.pi / 2, 0.0, 0.0)),
}
"""Frames of the flange in that of the last link."""

WRIST_3_T_GRIPPER = Pose.from_rpy((0.0, 0.1, 0.0), (90 * 0.0174533, 0.0, 0.0))
"""The cup on the last link, turned with the original's rounding."""

_BEND_1, _BEND_2 = (Pose.from_rpy(at, (0.0, math.pi / 2, 0.0)) for at in ((0.0, 0.220941, 0.0), (0.0, 0.0, 0.5723)))
_SLIDE = Limits(-RAIL_LIMIT, RAIL_LIMIT, 1000.0, 3.0)
_Y, _Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class JointFigures:
    """Figures of a joint's drive beyond a robot's description.

    Attributes:
        gains: gains of the original's effort controller.
        damping: viscous [N s/m] or [N m s/rad].
        friction: dry [N] or [N m], as published. In the original it never acted. The engine dropped the motor that
            carries it, since it sets both stops of a damped joint to one value. Only the URDF contains it.
        stiffness: position gain of the `precise` profile.
        armature: inertia of the drive at the joint, `precise` profile [kg] or [kg m^2].
    """

    gains: JointGains
    damping: float
    friction: float
    stiffness: float
    armature: float


FIGURES: Mapping[str, JointFigures] = dict(
    zip(
        ARM_JOINTS,
        (
            JointFigures(JointGains(10000, 500, 0, 1), 20, 500, 6e5, 10.0),
            JointFigures(JointGains(10000, 150, 0, 1), 20, 20, 1.2e5, 1.0),
            JointFigures(JointGains(50000, 150, 10, 50), 20, 0, 1.2e5, 1.0),
            JointFigures(JointGains(50000, 150, 1, 25), 20, 0, 1.2e5, 0.5),
            JointFigures(JointGains(100, 5, 0, 1), 1, 0, 1.2e4, 0.1),
            JointFigures(JointGains(75, 2, 0, 1), 1, 0, 1.2e4, 0.1),
            JointFigures(JointGains(25, 1, 0, 1), 0.5, 0, 1.2e4, 0.1),
        ),
        strict=True,
    )
)
"""Figures of each joint's drive. As in the original, no command is clamped to the published velocity."""


def _cylinder(name: str, mass: float, radius: float, length: float, middle: float = 0.0) -> Link:
    """Return a link with the inertia of a solid cylinder along z, whose middle is at a height in the link's frame."""
    across, along = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
    return Link(name, Inertial(mass, Pose((0.0, 0.0, middle)), (across, across, along, 0.0, 0.0, 0.0)))


def _turning(name: str, parent: str, child: str, origin: Pose, axis: Vector3, effort: float, velocity: float) -> Joint:
    limits = Limits(-TURN_LIMIT, TURN_LIMIT, effort, velocity)
    return Joint(name, JointType.REVOLUTE, parent, child, origin, axis, limits)


_LINKS = (
    Link(RAIL),
    _cylinder("base_link", 4.0, 0.075, 0.038),
    _cylinder("shoulder_link", 7.778, 0.075, 0.178),
    _cylinder("upper_arm_link", 12.93, 0.075, 0.612, 0.306),
    _cylinder("forearm_link", 3.87, 0.075, 0.5723, 0.28615),
    _cylinder("wrist_1_link", 1.96, 0.075, 0.12),
    _cylinder("wrist_2_link", 1.96, 0.075, 0.12),
    _cylinder("wrist_3_link", 0.202, 0.075, 0.12),
    _cylinder(GRIPPER, 0.01, 0.05, 0.01),
)

UR10 = RobotModel(
    "ur10",
    RAIL,
    {link.name: link for link in _LINKS},
    (
        Joint(ARM_JOINTS[0], JointType.PRISMATIC, RAIL, "base_link", Pose((0.0, 0.0, 0.1)), _Y, _SLIDE),
        _turning(ARM_JOINTS[1], "base_link", "shoulder_link", Pose((0.0, 0.0, 0.1273)), _Z, 530.0, 2.16),
        _turning(ARM_JOINTS[2], "shoulder_link", "upper_arm_link", _BEND_1, _Y, 330.0, 2.16),
        _turning(ARM_JOINTS[3], "upper_arm_link", "forearm_link", Pose((0.0, -0.1719, 0.612)), _Y, 150.0, 3.15),
        _turning(ARM_JOINTS[4], "forearm_link", "wrist_1_link", _BEND_2, _Y, 54.0, 3.2),
        _turning(ARM_JOINTS[5], "wrist_1_link", "wrist_2_link", Pose((0.0, 0.1149, 0.0)), _Z, 54.0, 3.2),
        _turning(ARM_JOINTS[6], "wrist_2_link", "wrist_3_link", Pose((0.0, 0.0, 0.1157)), _Y, 54.0, 3.2),
        Joint(GRIPPER_JOINT, JointType.FIXED, "wrist_3_link", GRIPPER, WRIST_3_T_GRIPPER),
    ),
)
"""Rail, arm and cup; the joints are in the order of the controller, then the cup's."""
