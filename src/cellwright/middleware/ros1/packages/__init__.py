"""Cellwright's ROS 1 packages: as data in `packages`, laid out for a shell (`tree`) or as catkin sources (`workspace`).

A cell runs without anything of this, and nothing here imports ROS: it starts ROS's own tools.
"""
