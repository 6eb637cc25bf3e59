"""Cellwright's ROS 1 packages: as data in `packages`, laid out for a shell (`tree`) or as catkin sources (`workspace`).

Nothing here is needed to run a cell, and nothing imports ROS: what has to be done with ROS's own tools is done by
starting them.
"""
