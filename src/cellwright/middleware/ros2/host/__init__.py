"""ROS 2 beside a served cell or robot: finds an interpreter that has rclpy."""
