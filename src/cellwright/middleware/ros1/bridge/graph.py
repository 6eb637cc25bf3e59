"""The node graph as clients of the original see it: who subscribes, also where nothing needs to be sent."""

from __future__ import annotations

from typing import Any

import rospy
import rospy.core
from rospy.impl.registration import Registration, get_topic_manager

HEARD_BY_ITSELF = ("/ariac/gripper/state", "/ariac/trays")
"""Topics that the original's own task manager, a part of /gazebo, subscribes to."""
HEARD_FOR_FRAMES = "/ariac/joint_states"
"""What the node that makes the arm's frames subscribes to."""


class OwnSubscription:
    """A subscription to what the node itself publishes: known to the graph, but without a connection.

    Args:
        name: topic.
        type_name: its type.
    """

    def __init__(self, name: str, type_name: str) -> None:
        self.resolved_name = self.name = name
        self.type = type_name
        self.ref_count = 1

    def register(self) -> None:
        """Announce it to the master."""
        manager = get_topic_manager()
        manager._add(self, manager.subs, Registration.SUB)

    def has_connection(self, _uri: str) -> bool:
        """Whether there is a connection to a publisher: none is needed."""
        return True

    def get_stats_info(self) -> list[Any]:
        """Both ends of what is no connection, as a node in C++ tells of it when it hears itself."""
        within = ("INTRAPROCESS", self.name, True, "")
        return [(0, rospy.core.get_node_uri(), "i", *within), (0, rospy.get_name(), "o", *within)]

    def get_stats(self) -> Any:
        """What was received over each connection: nothing."""
        return self.name, []

    def check(self) -> None:
        """Called by rospy to find dead connections."""

    def close(self) -> None:
        """Called by rospy when the node ends."""
