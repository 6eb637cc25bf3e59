"""Arm motion: inverse kinematics, tool paths, trajectories and interception of parts on the belt.

Pure geometry and timing: nothing here connects to a cell, so that any controller can use it. Poses are
`world_T_gripper`, joints `Joints`, times in seconds. The world is that of 2017's cell. For a cell whose rail stands
elsewhere it is the arm's frame, see `arm_frame`.
"""

from cellwright.motion.interception import Interception, MovingPart, Rendezvous, intercept, track
from cellwright.motion.joint_motion import JointMotion, MotionPoint
from cellwright.motion.joints import DEFAULT_LIMITS, LIMITS, Joints, JointsLike, MotionLimits
from cellwright.motion.kinematics import arm_frame, face, forward, inverse, is_usual, link_poses, solve, tool_down
from cellwright.motion.paths import follow, straight
from cellwright.motion.servo import ORIGINAL_SERVO, ServoModel, anticipated
from cellwright.motion.trajectories import along, move, through, timed

__all__ = [
    "DEFAULT_LIMITS",
    "LIMITS",
    "ORIGINAL_SERVO",
    "Interception",
    "JointMotion",
    "Joints",
    "JointsLike",
    "MotionLimits",
    "MotionPoint",
    "MovingPart",
    "Rendezvous",
    "ServoModel",
    "along",
    "anticipated",
    "arm_frame",
    "face",
    "follow",
    "forward",
    "intercept",
    "inverse",
    "is_usual",
    "link_poses",
    "move",
    "solve",
    "straight",
    "through",
    "timed",
    "tool_down",
    "track",
]
