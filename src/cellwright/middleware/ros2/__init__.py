"""ROS 2: the bridge, its host in the process of a served cell or robot, and the packages."""
