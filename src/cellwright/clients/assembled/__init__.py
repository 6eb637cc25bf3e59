"""`AssembledRobot`: a robot in a process of its own, held in the hand of a program as the io_teleop stack has it.

Nothing here needs more than Python's standard library (3.8 or later), for the program may be a node of ROS under the
system's Python, where nothing of Cellwright's is installed. The physics is the controller node's, under Cellwright's
own Python; the two talk over the link of `cellwright.middleware.wire`.
"""

from cellwright.clients.assembled.joints import JointStates
from cellwright.clients.assembled.robot import AssembledRobot

__all__ = ["AssembledRobot", "JointStates"]
