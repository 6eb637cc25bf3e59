"""What the process of a cell, or of a robot, does for ROS 1: finds it, has a master, keeps the bridge going.

Nothing of ROS is imported here: the bridge is a process of its own, under the interpreter that has rospy.
"""

from cellwright.middleware.ros1.host.ros1 import Ros1

__all__ = ["Ros1"]
