"""Mechanisms in the engine: chains of links with their servos and shapes, and the trajectories that they follow.

The cell's arms and the robots of the robot face stand on it.
"""
