"""Messages, topics and services: in one process, over sockets and over both generations of ROS."""
