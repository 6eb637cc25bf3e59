"""Topics of the relay in ROS 2, either way."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

from cellwright.middleware.ros2.bridge.acquaintance import Acquaintance
from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, is_values
from cellwright.middleware.ros2.bridge.node import RosNode, quality, relative
from cellwright.middleware.ros2.bridge.topics import as_bytes
from cellwright.middleware.wire.graph import PublishedTopic, SubscribedTopic

DEPTH = 1000
"""Messages that may wait on a topic, either way."""
SETTLING = 5.0
"""Time for a subscription to be known to the publisher [s]."""


class Ros2Subscription(SubscribedTopic):
    """Subscription in ROS 2; a message's number is that of its publisher.

    A topic that does not exist yet has no type: it is looked for again.
    """

    def __init__(
        self, ros: RosNode, name: str, type_name: str, deliver: Callable[[tuple[int, ...], bytes], None]
    ) -> None:
        super().__init__(name, deliver)
        self._ros = ros
        self._type = type_name
        self._is_latched = False
        self._subscription: Any = None
        self._begin()

    def _begin(self) -> None:
        """Subscribe with the quality of service of the publishers, if the type is known."""
        publishers = self._ros.node.get_publishers_info_by_topic(relative(self.name))
        self._type = self._type or next((info.topic_type.replace("/msg/", "/") for info in publishers), "")
        if not self._type:
            return
        self._is_latched = any(info.qos_profile.durability.name == "TRANSIENT_LOCAL" for info in publishers)
        is_reliable = all(info.qos_profile.reliability.name == "RELIABLE" for info in publishers)
        self._subscription = self._ros.node.create_subscription(
            interface_class(self._type, "msg"),
            relative(self.name),
            self._take,
            quality(is_reliable=is_reliable, is_transient_local=self._is_latched, depth=DEPTH),
            raw=not is_values(self._type),
            callback_group=self._ros.group,
        )

    @property
    def is_connected(self) -> bool:
        """True if a publisher is known."""
        if self._subscription is None:
            self._begin()
        return bool(self._ros.node.count_publishers(self._ros.full_name(self.name)))

    def settle(self, before: int) -> None:
        """Do not wait for the messages before the subscription, of which only a latched one comes."""
        with self._changed:
            self._received = max(self._received, 0 if self._is_latched else before)
        if self._is_latched and before:
            self.wait_for(before, SETTLING)

    def close(self) -> None:
        """Unsubscribe."""
        if self._subscription is not None:
            self._ros.node.destroy_subscription(self._subscription)

    def _take(self, message: Any, info: Any) -> None:
        data = as_bytes(message, self._type) if is_values(self._type) else message
        number = info["publication_sequence_number"]
        self.take(data, number, is_latched=self._is_latched)


class Ros2Publication(PublishedTopic):
    """Publication in ROS 2; `base` messages came from others before."""

    def __init__(self, ros: RosNode, name: str, type_name: str, base: int) -> None:
        self.name = name
        self.type = type_name
        self.published = base
        self._begin = 0.0
        self._acquaintance: Acquaintance | None = None
        self._class = interface_class(type_name, "msg")
        self._is_values = is_values(type_name)
        qos = quality(is_reliable=True, is_transient_local=False, depth=DEPTH)
        self._publisher = ros.node.create_publisher(self._class, relative(name), qos)

    def await_subscribers(self, acquaintance: Acquaintance, delay: float) -> None:
        """Connect once nodes know this publication, and after `delay` [s] at the earliest."""
        self._acquaintance, self._begin = acquaintance, time.monotonic() + delay

    @property
    def is_connected(self) -> bool:
        """True if it has a subscriber, which knows it."""
        if not self._publisher.get_subscription_count() or time.monotonic() < self._begin:
            return False
        return self._acquaintance is None or self._acquaintance.is_made()

    def publish(self, data: bytes) -> None:
        """Send a message."""
        self.published += 1
        self._publisher.publish(fill(self._class(), json.loads(data)) if self._is_values else data)
