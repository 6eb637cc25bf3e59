"""The relay's ends in ROS: topics that its client listens to, and topics that it speaks on."""

from __future__ import annotations

import struct
import threading
import warnings
from typing import Any, Callable

import rospy

from cellwright.middleware.ros1.bridge.headers import has_header
from cellwright.middleware.ros1.bridge.raw_types import ANY, raw_type


class HeardTopic:
    """A topic that the client listens to, by any number of subscriptions.

    Args:
        name: topic.
        type_name: its type.
        deliver: takes the numbers of the subscriptions and a message; from rospy's threads.
    """

    def __init__(self, name: str, type_name: str, deliver: Callable[[tuple[int, ...], bytes], None]) -> None:
        self.name = name
        self._deliver = deliver
        self._numbers: tuple[int, ...] = ()
        self._changed = threading.Condition()
        self._header: Any = None
        self._received = 0
        self._latched: bytes | None = None
        self._subscriber = rospy.Subscriber(name, raw_type(type_name or ANY), self._take, tcp_nodelay=True)

    @property
    def is_connected(self) -> bool:
        """Whether there is a publisher that it gets messages of: one that has answered its handshake."""
        return any(connection.header for connection in self._subscriber.impl.connections)

    @property
    def is_wanted(self) -> bool:
        """Whether there is a subscription."""
        return bool(self._numbers)

    def add(self, number: int) -> None:
        """Add a subscription; what is latched comes at once."""
        with self._changed:
            self._numbers = (*self._numbers, number)
            if self._latched is not None:
                self._deliver((number,), self._latched)

    def remove(self, number: int) -> bool:
        """Remove a subscription; whether it was one of this topic."""
        with self._changed:
            was_there = number in self._numbers
            self._numbers = tuple(each for each in self._numbers if each != number)
        return was_there

    def wait_for(self, count: int, patience: float) -> bool:
        """Wait until so many messages have come since the publisher was connected to; whether they did in time [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self._received >= count, patience)

    def close(self) -> None:
        """Listen no more."""
        self._subscriber.unregister()

    def _take(self, message: Any) -> None:
        header = message._connection_header
        with self._changed:
            if header is not self._header:
                self._header, self._received = header, 0
            self._received += 1
            if header.get("latching") == "1":
                self._latched = message.data
            self._deliver(self._numbers, message.data)
            self._changed.notify_all()


class SpokenTopic:
    """A topic that the client publishes on.

    Args:
        name: topic.
        type_name: its type.
        md5: checksum of the type.
        definition: of the type.
    """

    def __init__(self, name: str, type_name: str, md5: str, definition: str) -> None:
        self.name = name
        self.type = type_name
        self.published = 0
        """How many messages there were."""
        self._has_header = has_header(definition)
        self._class = raw_type(type_name, md5, definition)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it recommends a queue; nothing is to wait here
            self._publisher = rospy.Publisher(name, self._class, tcp_nodelay=True, queue_size=None)

    @property
    def is_connected(self) -> bool:
        """Whether somebody hears it."""
        return bool(self._publisher.get_num_connections())

    def publish(self, data: bytes) -> None:
        """Send a message."""
        if self._has_header:
            data = struct.pack("<I", self.published & 0xFFFFFFFF) + data[4:]
        self.published += 1
        self._publisher.publish(self._class(data))
