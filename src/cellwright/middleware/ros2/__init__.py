"""ROS 2: a bridge presents a cell or robot to ROS 2; it runs under an interpreter that has rclpy.

Packages of interfaces come from the definitions in `cellwright.middleware.messages`, and are built once for a machine.
"""
