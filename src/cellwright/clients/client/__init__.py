"""Client of a cell or robot: the interface of programs, over every transport."""

from cellwright.clients.client.arm import ARM_JOINTS, ClientArm, trajectory_message
from cellwright.clients.client.client import Client
from cellwright.clients.client.pictures import CameraPicture, LatestPicture
from cellwright.clients.client.session import Latest, NodeClient, Rate

__all__ = [
    "ARM_JOINTS",
    "CameraPicture",
    "Client",
    "ClientArm",
    "Latest",
    "LatestPicture",
    "NodeClient",
    "Rate",
    "trajectory_message",
]
