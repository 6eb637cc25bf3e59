"""Lengths of arms of Universal Robots."""

from cellwright.motion.kinematics import LENGTHS
from cellwright.motion.ur import UrConstants

UR_ARMS = {
    "UR3": UrConstants(0.1519, 0.24365, 0.21325, 0.11235, 0.08535, 0.0819, 0.1198, -0.0925),
    "UR5": UrConstants(0.089159, 0.425, 0.39225, 0.10915, 0.09465, 0.0823, 0.13585, -0.1197),
    "UR10": LENGTHS,
    "UR3e": UrConstants(0.15185, 0.24355, 0.2132, 0.13105, 0.08535, 0.0921),
    "UR5e": UrConstants(0.1625, 0.425, 0.3922, 0.1333, 0.0997, 0.0996),
    "UR10e": UrConstants(0.1807, 0.6127, 0.57155, 0.17415, 0.11985, 0.11655),
    "UR16e": UrConstants(0.1807, 0.4784, 0.36, 0.17415, 0.11985, 0.11655),
}
"""Constants by the name of the arm, as Universal Robots publishes them under "DH Parameters for calculations of
kinematics and dynamics". The offsets are those of the robot descriptions of ROS 1."""
