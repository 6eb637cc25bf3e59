"""Moving the arm: inverse kinematics, tool paths, trajectories and meeting parts on the belt.

Pure geometry and timing: nothing here talks to a cell, so that a controller of one's own can use it as well. Poses are
`world_T_gripper`, joints `Joints`, times in seconds.
"""

from cellwright.motion.choice import solve
from cellwright.motion.joints import LIMITS, Joints, JointsLike
from cellwright.motion.ur import face, forward, inverse, is_usual, link_poses, tool_down

__all__ = [
    "LIMITS",
    "Joints",
    "JointsLike",
    "face",
    "forward",
    "inverse",
    "is_usual",
    "link_poses",
    "solve",
    "tool_down",
]
