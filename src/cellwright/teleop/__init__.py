"""The robot controller node: any robot, driven over the `io_teleop` topics."""
