"""Client of a cell or robot: the interface of programs, over every transport."""

from cellwright.clients.client.client import ARM_JOINTS, Client, trajectory_message
from cellwright.clients.client.session import Latest, NodeClient, Rate, Session

__all__ = ["ARM_JOINTS", "Client", "Latest", "NodeClient", "Rate", "Session", "trajectory_message"]
