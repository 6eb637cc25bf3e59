"""Topics of the bridge: publications of the cell in ROS 2, and ROS 2 commands to the cell.

The bridge subscribes to a topic of the cell only while it has a subscriber in ROS 2, since building messages costs
time. To latched topics it subscribes all the time: their newest message waits in the publisher for late subscribers.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from functools import partial
from typing import Any

from rclpy.serialization import serialize_message

from cellwright.middleware.ros2.bridge.broadcast import NAME as BROADCAST
from cellwright.middleware.ros2.bridge.broadcast import with_frame
from cellwright.middleware.ros2.bridge.interfaces import fill, interface_class, is_values, values_of
from cellwright.middleware.ros2.bridge.node import RosNode, quality, relative
from cellwright.middleware.ros2.bridge.publisher_numbers import PublisherNumbers
from cellwright.middleware.wire.command_queue import CommandQueue
from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog
from cellwright.middleware.wire.frames import Frame
from cellwright.middleware.wire.quiet_clock import QuietClock

LOCKSTEP_DEPTH = 1000
"""Messages that are kept for a subscriber in lockstep, where nothing must be lost."""

CLOCK_PERIOD = 4_000_000
"""Shortest simulation time [ns] between two messages on /clock: 250 Hz, a tenth of a core for each subscriber."""

_STAMP, _LITTLE_ENDIAN = struct.Struct("<4siI"), b"\0\1\0\0"
_NANOSECONDS = 1_000_000_000


class Publication:
    """Topic of the cell, published in ROS 2 under each of `names`.

    `sent` has the number of messages by topic, as subscribers see it; the topic of the newest message comes last.
    """

    def __init__(
        self,
        ros: RosNode,
        link: LinkClient,
        topic: dict[str, Any],
        names: Sequence[str],
        sent: dict[str, int],
        *,
        in_lockstep: bool,
    ) -> None:
        self.name: str = topic["name"]
        self._link = link
        self._sent = sent
        self._is_listening = False
        self._class = interface_class(topic["type"], "msg")
        self._is_values = is_values(topic["type"])
        self._always = bool(topic["latch"])
        wanted = topic["qos"]
        depth = max(wanted["depth"], len(topic["publishers"]) if self._always else 1)
        qos = quality(
            is_reliable=wanted["reliable"],
            is_transient_local=wanted["transient_local"],
            depth=max(depth, LOCKSTEP_DEPTH) if in_lockstep and not self._always else depth,
        )
        self._names = names
        self._publishers = [ros.node.create_publisher(self._class, relative(name), qos) for name in names]
        self._subscription: int | None = None
        if self._always:
            self._listen()

    def is_ready_for(self, subscribers: int) -> bool:
        """Return whether this number of subscribers is known, and they get all that the cell publishes from now on."""
        self.look()
        return self._is_listening and self._count_subscribers() >= subscribers

    def look(self) -> None:
        """Subscribe to the topic of the cell, or end this, by whether it has subscribers in ROS 2."""
        if self._always:
            return
        has_subscribers = self._count_subscribers() > 0
        if has_subscribers and self._subscription is None:
            self._listen()
        elif not has_subscribers and self._subscription is not None:
            self._link.unsubscribe(self._subscription)
            self._subscription, self._is_listening = None, False

    def _count_subscribers(self) -> int:
        return sum(publisher.get_subscription_count() for publisher in self._publishers)

    def _listen(self) -> None:
        self._subscription = self._link.subscribe(self.name, "", self._publish, self._answered)

    def _answered(self, answer: Frame) -> None:
        self._is_listening = self._is_listening or answer.number == self._subscription

    def _publish(self, payload: bytes) -> None:
        self._sent[self.name] = self._sent.pop(self.name, 0) + 1
        message = fill(self._class(), json.loads(payload)) if self._is_values else payload
        self._send(message)

    def _send(self, message: Any) -> None:
        for publisher in self._publishers:
            publisher.publish(message)


class ClockPublication(Publication):
    """Simulation time, no more often than each `CLOCK_PERIOD`, and again and again while it stands.

    In lockstep a plain `Publication` has each tick's, since steps count messages.
    """

    _newest: int | None = None
    _held: bytes | None = None

    def __init__(self, ros: RosNode, link: LinkClient, *more: Any, **options: Any) -> None:
        super().__init__(ros, link, *more, **options)
        self._quiet = QuietClock(link, self._repeat, lambda: self._count_subscribers() > 0)

    def flush(self) -> None:
        """Publish the newest time if it came too early for that, as after a single step."""
        if self._held is not None:
            self._now(self._held)

    def _publish(self, payload: bytes) -> None:
        self._quiet.note()
        now = _time_of(payload)
        if self._newest is None or not 0 <= now - self._newest < CLOCK_PERIOD:
            self._now(payload)
        else:
            self._held = payload

    def _repeat(self, time: int) -> None:
        self._now(_STAMP.pack(_LITTLE_ENDIAN, *divmod(time, _NANOSECONDS)))

    def _now(self, payload: bytes) -> None:
        self._newest, self._held = _time_of(payload), None
        super()._publish(payload)


class JointStates(Publication):
    """Joint states of a cell: as a broadcaster's under its name, and as they are under others, such as that of 2017."""

    def _send(self, message: Any) -> None:
        for name, publisher in zip(self._names, self._publishers, strict=True):
            publisher.publish(with_frame(message) if name == BROADCAST else message)


class CommandTopic(CommandQueue):
    """Topic that the cell receives, subscribed to in ROS 2 under each of `names`. Who has sent a message is unknown."""

    def __init__(
        self,
        ros: RosNode,
        loop: EventLoop,
        link: LinkClient,
        topic: dict[str, Any],
        names: Sequence[str],
        sender: str,
        **more: Any,
    ) -> None:
        super().__init__(loop, link, topic["name"], topic["type"], log=ros.log, are_unknown=True, **more)
        wanted = topic["qos"]
        self._sender = sender
        self._node = ros.node
        self._names = [ros.full_name(name) for name in names]
        self._is_values = is_values(topic["type"])
        qos = quality(is_reliable=wanted["reliable"], is_transient_local=False, depth=wanted["depth"])
        self._losses = ThrottledLog(loop, "{count} messages on {subject} lost before the bridge read them")
        message_class = interface_class(topic["type"], "msg")
        for name in names:
            numbers = PublisherNumbers(partial(ros.node.count_publishers, ros.full_name(name)))
            take = partial(self._take, numbers, ros.full_name(name))
            ros.receiver.subscribe(message_class, relative(name), take, qos, raw=not self._is_values)

    def count_publishers(self) -> int:
        """Return the number of nodes that may command it."""
        return sum(self._node.count_publishers(name) for name in self._names)

    def _take(self, numbers: PublisherNumbers, name: str, message: Any, number: int) -> None:
        self._losses.count(self.name, numbers.note(number))
        data = json.dumps(values_of(message)).encode() if self._is_values else message
        self.take(self._sender, data, name=name)


def _time_of(payload: bytes) -> int:
    _, seconds, rest = _STAMP.unpack_from(payload)
    return int(seconds * _NANOSECONDS + rest)


def as_bytes(message: Any, type_name: str) -> bytes:
    """Return a message of ROS 2 for the cell."""
    data: bytes = json.dumps(values_of(message)).encode() if is_values(type_name) else serialize_message(message)
    return data
