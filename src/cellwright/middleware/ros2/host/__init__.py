"""ROS 2 side of a cell's or robot's process: finds ROS 2, and supervises the bridge.

Nothing of ROS is imported here: the bridge is a separate process, under a Python that has rclpy.
"""

from cellwright.middleware.ros2.host.ros2 import Ros2, Ros2Options

__all__ = ["Ros2", "Ros2Options"]
