"""Robot controller node: any robot, driven over the `io_teleop` topics.

`AssembledRobot` is for programs that are controller nodes themselves, as those of the io_teleop stack are.
"""

from cellwright.clients.assembled import AssembledRobot, JointStates

__all__ = ["AssembledRobot", "JointStates"]
