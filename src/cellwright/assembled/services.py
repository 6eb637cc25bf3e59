"""Names of the services by which a program and the process of its robot talk: JSON objects both ways."""

DESCRIBE = "/cellwright/robot/describe"
"""The robot: joints, arms, grippers, head, lift, and where its root link is."""
STATE = "/cellwright/robot/state"
"""Positions, velocities and efforts of all movable joints, positions and targets of the driven ones, where the body is
that carries the robot, and the poses of the links asked for by index."""
MOVE = "/cellwright/robot/move"
"""Have joints, by index, go to positions."""
PLACE = "/cellwright/robot/place"
"""Put joints, by index, at positions at once."""
PLACE_BASE = "/cellwright/robot/place_base"
"""Put the root link at a pose at once."""
