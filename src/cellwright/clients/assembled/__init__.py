"""`AssembledRobot`: a robot in a process of its own, with the Python interface of the io_teleop stack.

Nothing here needs more than Python's standard library (3.8 or later). The program may be a ROS node under the system's
Python, which has no packages of Cellwright's. The controller node runs the physics under Cellwright's own Python; the
two exchange frames of `cellwright.middleware.wire`.
"""

from cellwright.clients.assembled.joints import JointStates
from cellwright.clients.assembled.robot import AssembledRobot

__all__ = ["AssembledRobot", "JointStates"]
