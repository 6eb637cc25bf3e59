"""Look at ROS 2's graph: nodes that define a type otherwise, whose messages never arrive, and namesakes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cellwright.middleware.ros2.bridge.node import RosNode
from cellwright.middleware.wire.event_loop import EventLoop, report

PERIOD = 2.0  # time between two looks [s]


NAMESAKE_PATIENCE = 30.0
"""Time [s] after which the graph has forgotten a node that was killed."""


class GraphWatch:
    """Reports once each node whose topic has another type than the cell's: by name, or by the hash of its fields.

    It also reports a node of the same name, if it is there after `patience` [s].
    """

    def __init__(self, ros: RosNode, loop: EventLoop, topics: Sequence[str], patience: float) -> None:
        self._ros = ros
        self._has_namesake = False
        loop.later(patience, self._look_for_namesake)
        self._node = ros.node
        self._loop = loop
        self._topics = [ros.full_name(name) for name in topics]
        self._reported: set[tuple[str, str]] = set()
        self._me = (self._node.get_name(), self._node.get_namespace())
        loop.later(PERIOD, self._look)

    def _look_for_namesake(self) -> None:
        """Report another node of this name when it appears: clients reach one or the other, or both."""
        before = self._has_namesake
        self._has_namesake = self._node.get_node_names_and_namespaces().count(self._me) > 1
        if self._has_namesake and not before:
            name = self._node.get_fully_qualified_name()
            line = (
                f"another node {name} is in this domain: programs reach either or both, and mix their messages; give "
                "one a namespace (--ros-args -r __ns:=/cell2) or a ROS_DOMAIN_ID of its own"
            )
            self._ros.say(line)
        self._loop.later(PERIOD, self._look_for_namesake)

    def _look(self) -> None:
        for name in self._topics:
            ends = [*self._node.get_publishers_info_by_topic(name), *self._node.get_subscriptions_info_by_topic(name)]
            mine = next((_type_of(end) for end in ends if (end.node_name, end.node_namespace) == self._me), None)
            for end in ends:
                key = (name, f"{end.node_namespace.rstrip('/')}/{end.node_name}")
                if mine is None or _type_of(end) == mine or key in self._reported:
                    continue
                self._reported.add(key)
                same = "another definition of it" if end.topic_type == mine[0] else end.topic_type
                report(f"{name}: {key[1]} has {same}, not {mine[0]} as here; nothing passes between them")
        self._loop.later(PERIOD, self._look)


def _type_of(end: Any) -> tuple[str, str]:
    """Return name and hash of the type of one end of a topic; older distributions know no hash."""
    found = getattr(end, "topic_type_hash", None)
    return end.topic_type, "" if found is None else str(found)
