"""Bridge between a served cell or robot and ROS 2, a process of its own under a Python that has rclpy.

It loads the standard library, rclpy and `cellwright.middleware.wire` alone, under Python 3.10 or newer. It knows names,
types and quality of service from the cell's welcome frame. Messages pass as the bytes of CDR, both ways; those of
control_msgs and of standard services, whose fields differ between distributions, pass as JSON values by field name.
"""
