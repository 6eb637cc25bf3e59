"""Names and limits of the arm of 2017: a UR10 on a rail."""

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
