"""ROS 1 side of a cell's or robot's process: finds ROS 1, provides a master, and supervises the bridge.

Nothing of ROS is imported here: the bridge is a separate process, under the interpreter that has rospy.
"""

from cellwright.middleware.ros1.host.ros1 import Ros1

__all__ = ["Ros1"]
