"""One topic: who publishes on it, who listens, and who hears of that."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Any, TypeAlias

from cellwright.errors import UsageError
from cellwright.messages import Message, message_type, said, short_name

Callback: TypeAlias = Callable[[Any], None]
"""Takes a message of the topic's class."""

Handler: TypeAlias = Callable[[Any, str], Any]
"""Takes a message or request, and the name of the node that it came from."""


class Direction(Enum):
    """Which way the messages of a topic go, as seen from the cell."""

    OUT = "out"
    IN = "in"


class Subscription:
    """A callback that gets every message of a topic until it is cancelled."""

    def __init__(self, topic: Topic, callback: Callback, node: str, origin: str | None, *, along: bool) -> None:
        self._topic = topic
        self.along = along
        """Whether it only gets what is made for others, and is counted as nobody."""
        self.callback = callback
        self.node = node
        self.origin = origin

    @property
    def topic(self) -> str:
        """Name of the topic."""
        return self._topic.name

    def cancel(self) -> None:
        """Stop listening; again is no error. A message that is just being delivered may still come."""
        self._topic.remove(self)


class Publisher:
    """What publishes on a topic.

    Args:
        topic: the topic.
        node: whose it is.
        latch: a listener that comes late is given the newest message.
        on_listeners: is told the number of listeners whenever it changes: for what is sampled only while somebody
            listens. The newest message is then forgotten when the last listener goes, since it grows old.
    """

    def __init__(self, topic: Topic, node: str, on_listeners: Callable[[int], None] | None, *, latch: bool) -> None:
        self._topic = topic
        self._class = topic.message_class
        self._callbacks: tuple[Callback, ...] = ()
        self._count = 0
        self.node = node
        self.latch = latch
        self.on_listeners = on_listeners
        self.newest: Message | None = None

    @property
    def topic(self) -> str:
        """Name of the topic."""
        return self._topic.name

    @property
    def listeners(self) -> int:
        """How many listen to this publisher, without those who only listen along."""
        return self._count

    @property
    def listening_nodes(self) -> tuple[str, ...]:
        """The nodes that listen, in the order in which they came."""
        return tuple(each.node for each in self._topic.subscriptions_to(self.node))

    def publish(self, message: Message) -> None:
        """Give a message to every listener, in the order in which they came. Nobody changes it from here on.

        What a listener raises comes out here: listeners are transports, which keep their clients' errors to themselves.

        Raises:
            UsageError: the message is not of the topic's class.
        """
        if type(message) is not self._class:
            raise UsageError(f"{self.topic} carries {self._topic.type}, not {said(message)}")
        callbacks = self._callbacks
        if self.latch and (callbacks or self.on_listeners is None):
            self.newest = message
        for callback in callbacks:
            callback(message)

    def take_listeners(self) -> None:
        """Take note of who listens, and tell their number to whoever wants to know it."""
        before = self._callbacks
        subscriptions = self._topic.subscriptions_to(self.node)
        self._callbacks = tuple(each.callback for each in subscriptions)
        self._count = sum(not each.along for each in subscriptions)
        if self.on_listeners is not None and self._callbacks != before:
            self.on_listeners(self._count)

    def forget_sample(self) -> None:
        """Forget the newest message of what is sampled only while somebody listens, when nobody does."""
        if self.on_listeners is not None and not self._count:
            self.newest = None


class Topic:
    """A name that messages of one type go by. Without a type it is only waited for."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.type = ""
        self.message_class: type[Message] | None = None
        self.direction: Direction | None = None
        self.rate = ""
        self.publishers: list[Publisher] = []
        self.handler: Handler | None = None
        self.handling_node = ""
        self.subscriptions: list[Subscription] = []

    def declare(self, type_name: str, direction: Direction, rate: str) -> None:
        """Settle the type and the direction; further publishers must agree.

        Raises:
            UsageError: it was settled otherwise before.
            UnknownNameError: there is no message type of this name.
        """
        message_class = message_type(type_name)
        if self.direction is not None and (self.message_class, self.direction) != (message_class, direction):
            raise UsageError(
                f"{self.name} carries {self.type} {self.direction.value}, not {type_name} {direction.value} as well"
            )
        self.type = short_name(message_class.__msgtype__)
        self.message_class = message_class
        self.direction = direction
        self.rate = self.rate or rate

    def add_publisher(self, publisher: Publisher) -> None:
        """Let something publish; it is told at once if somebody has been waiting."""
        self.publishers.append(publisher)
        publisher.take_listeners()

    def add(self, subscription: Subscription) -> None:
        """Let somebody listen: what is latched comes first."""
        self.subscriptions.append(subscription)
        for publisher in self.publishers:
            if publisher.newest is not None and subscription.origin in (None, publisher.node):
                subscription.callback(publisher.newest)
        self._tell_publishers()

    def remove(self, subscription: Subscription) -> None:
        """Let somebody go."""
        if subscription in self.subscriptions:
            self.subscriptions.remove(subscription)
            self._tell_publishers()
            for publisher in self.publishers:
                publisher.forget_sample()

    def subscriptions_to(self, node: str) -> list[Subscription]:
        """Who wants what a node says here."""
        return [each for each in self.subscriptions if each.origin in (None, node)]

    def _tell_publishers(self) -> None:
        for publisher in self.publishers:
            publisher.take_listeners()
