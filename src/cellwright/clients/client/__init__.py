"""Client of a cell or robot: the interface of programs, over every transport."""

from cellwright.clients.client.client import ARM_JOINTS, Client, trajectory_message
from cellwright.clients.client.pictures import CameraPicture, LatestPicture
from cellwright.clients.client.session import Latest, NodeClient, Rate

__all__ = [
    "ARM_JOINTS",
    "CameraPicture",
    "Client",
    "Latest",
    "LatestPicture",
    "NodeClient",
    "Rate",
    "trajectory_message",
]
