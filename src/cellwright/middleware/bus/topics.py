"""Topics of the bus: publishers, subscriptions, external input and pending responses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Any, TypeAlias

from cellwright.middleware.messages import Message, message_type, said, short_name
from cellwright.util.errors import UsageError


class How(StrEnum):
    """How something came."""

    PUBLISH = "publish"
    CALL = "call"
    EXTRA = "extra"
    """A service of the server itself, past the bus."""


@dataclass(frozen=True, slots=True)
class Given:
    """Something that came from outside.

    Attributes:
        how: how it came.
        name: of the topic or service.
        message: what was published, or the request; a dictionary of JSON values where it came past the bus.
        node: whom it came from.
    """

    how: How
    name: str
    message: Any
    node: str


class Later:
    """A service's response that is not there yet: the service answers once, whoever called hears of it."""

    def __init__(self) -> None:
        self.response: Message | None = None
        """The response, once it is there."""
        self._listeners: list[Callable[[Message], None]] = []

    def answer(self, response: Message) -> None:
        """Give the response. A second one counts for nothing."""
        if self.response is None:
            self.response = response
            for listener in self._listeners:
                listener(response)
            self._listeners.clear()

    def then(self, listener: Callable[[Message], None]) -> None:
        """Have `listener(response)` called when it is there; at once if it is."""
        if self.response is None:
            self._listeners.append(listener)
        else:
            listener(self.response)


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

    def __init__(
        self, topic: Topic, callback: Callback, node: str, origin: str | None, since: int, *, along: bool
    ) -> None:
        self._topic = topic
        self.since = since
        """Simulation time [ns] at which it began, or -1 after time has begun anew."""
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
        latch: a late listener gets the newest message. A latched topic is published whoever listens, since the newest
            message must not depend on that.
        on_listeners: called with the number of listeners whenever it changes: for what is sampled only while somebody
            listens.

    Raises:
        UsageError: latch and on_listeners exclude each other.
    """

    def __init__(self, topic: Topic, node: str, on_listeners: Callable[[int], None] | None, *, latch: bool) -> None:
        if latch and on_listeners is not None:
            raise UsageError(f"{topic.name}: a latched topic is published whoever listens; leave out on_listeners")
        self._topic = topic
        self._class = topic.message_class
        self._callbacks: tuple[Callback, ...] = ()
        self._count = 0
        self.node = node
        self.latch = latch
        self.on_listeners = on_listeners
        self._newest: Message | Callable[[], Message | None] | None = None

    @property
    def topic(self) -> str:
        """Name of the topic."""
        return self._topic.name

    @property
    def newest(self) -> Message | None:
        """The newest message of a latched topic; built now if nobody has needed it yet."""
        if callable(self._newest):
            self._newest = self._newest()
        return self._newest

    @newest.setter
    def newest(self, message: Message | None) -> None:
        self._newest = message

    @property
    def listeners(self) -> int:
        """How many listen to this publisher, without those who only listen along."""
        return self._count

    def publish(self, message: Message, *, measured: int | None = None) -> None:
        """Give a message to every listener, in the order in which they came. Nobody changes it from here on.

        What a listener raises comes out here: listeners are transports, which keep their clients' errors to themselves.

        Args:
            message: of the topic's class.
            measured: simulation time [ns] of what was sampled before it is published; listeners that began later do
                not get it, as if nobody had listened before them.

        Raises:
            UsageError: the message is not of the topic's class.
        """
        if type(message) is not self._class:
            raise UsageError(f"{self.topic} carries {self._topic.type}, not {said(message)}")
        if self.latch:
            self._newest = message
        elif measured is not None:
            for subscription in self._topic.subscriptions_to(self.node):
                if subscription.since < measured:
                    subscription.callback(message)
            return
        for callback in self._callbacks:
            callback(message)

    def offer(self, build: Callable[[], Message | None]) -> None:
        """Publish what `build` makes, on a latched topic; without a listener it is called when it is needed.

        Args:
            build: gives the same message whenever it is called; None when there is nothing to say.
        """
        if not self._callbacks:
            self._newest = build
        elif (message := build()) is not None:
            self.publish(message)

    def take_listeners(self) -> None:
        """Take note of who listens, and tell their number to whoever wants to know it."""
        before = self._callbacks
        subscriptions = self._topic.subscriptions_to(self.node)
        self._callbacks = tuple(each.callback for each in subscriptions)
        self._count = sum(not each.along for each in subscriptions)
        if self.on_listeners is not None and self._callbacks != before:
            self.on_listeners(self._count)


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
            if subscription.origin in (None, publisher.node) and (newest := publisher.newest) is not None:
                subscription.callback(newest)
        self._tell_publishers()

    def remove(self, subscription: Subscription) -> None:
        """Let somebody go."""
        if subscription in self.subscriptions:
            self.subscriptions.remove(subscription)
            self._tell_publishers()

    def subscriptions_to(self, node: str) -> list[Subscription]:
        """Who wants what a node says here."""
        return [each for each in self.subscriptions if each.origin in (None, node)]

    def _tell_publishers(self) -> None:
        for publisher in self.publishers:
            publisher.take_listeners()
