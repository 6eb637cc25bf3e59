"""What stands between the node and a robot."""
