"""Arm postures for tests, by joint, including the waypoints of the lesson."""

from cellwright.config.arm import ARM_JOINTS

_ORDER = (
    "elbow_joint",
    "linear_arm_actuator_joint",
    "shoulder_lift_joint",
    "shoulder_pan_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)


def posture(*values: float) -> dict[str, float]:
    """Return joint values by name, from values in the order of joint states."""
    return dict(zip(_ORDER, values, strict=True))


ZERO = dict.fromkeys(ARM_JOINTS, 0.0)
READY = posture(2.5, 0.0, -1.2, 3.20, 3.5, -1.51, 0.0)
PICK = posture(2.09, 0.25, -0.47, 3.2, 3.1, -1.51, 0.0)
PLACE = posture(1.02, 2.0, -0.27, 1.5, 4.0, -1.51, 0.0)
BY_BELT = posture(2.7, 1.88, -1.5, 0.0, 3.5, -1.51, 0.0)
ON_BELT = posture(1.65, 1.84, -0.66, 0.0, 3.7, -1.57, 0.0)
ABOVE_BIN = posture(2.09, 0.25, -1.0, 3.2, 3.7, -1.51, 0.0)
