"""Look at ROS 2's graph: other nodes that define a type otherwise, whose messages never arrive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cellwright.middleware.ros2.bridge.node import RosNode
from cellwright.middleware.wire.event_loop import EventLoop, report

PERIOD = 2.0  # time between two looks [s]


class TypeWatch:
    """Reports once each node whose topic has another type than the cell's: by name, or by the hash of its fields."""

    def __init__(self, ros: RosNode, loop: EventLoop, topics: Sequence[str]) -> None:
        self._node = ros.node
        self._loop = loop
        self._topics = [ros.full_name(name) for name in topics]
        self._reported: set[tuple[str, str]] = set()
        self._me = (self._node.get_name(), self._node.get_namespace())
        loop.later(PERIOD, self._look)

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
