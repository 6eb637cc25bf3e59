"""The cell's arm as planners of ROS 2 know it."""

from cellwright.cell.interface.parameters import robot_description
from cellwright.cell.interface.rows import CONTROLLER_NAMES, FOLLOW
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import GRIPPER, INITIAL_POSITIONS, UR10
from cellwright.middleware.ros2.packages.moveit import PlannedArm
from cellwright.motion.joints import DEFAULT_LIMITS


def planned_arm() -> PlannedArm:
    """Return the arm of a cell, with its home posture and the limits that the bundled agent keeps.

    At the published velocities the wrists lag behind by nearly as much as the controller tolerates.

    Example:
        >>> planned_arm().groups["arm"][0]
        'shoulder_pan_joint'
    """
    names = tuple(joint.name for joint in UR10.driven)
    return PlannedArm(
        urdf=robot_description(Trial("moveit", has_arm=True)),
        joints=names,
        flange="tool0",
        tool=GRIPPER,
        home=INITIAL_POSITIONS,
        max_velocity=dict(zip(names, DEFAULT_LIMITS.velocity, strict=True)),
        max_acceleration=dict(zip(names, DEFAULT_LIMITS.acceleration, strict=True)),
        action=CONTROLLER_NAMES[FOLLOW],
    )
