"""Messages, topics and services, in one process, over sockets and over ROS 1."""
