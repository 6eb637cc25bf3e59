"""Cellwright's ROS 2 packages: their contents, sources for colcon (`workspace`), and an environment of our own.

The environment has ROS 2 from pinned wheels (`environment`), and our interfaces from a wheel that is built once
(`build`).
"""
