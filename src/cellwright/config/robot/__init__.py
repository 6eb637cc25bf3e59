"""Robots as they are written: URDF files, robot configuration files, and the robots that come along."""
