"""Graph of a ROS as a relay needs it: topics, services and lockstep time, to be made by ROS 1 and ROS 2."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from typing import Any, Callable

from cellwright.middleware.wire.event_loop import MissingError


class ServiceGoneError(Exception):
    """The service cannot be reached; the text has the reason."""


class GraphGoneError(MissingError):
    """Nothing answers in the graph any more; the text says what."""


class SubscribedTopic(ABC):
    """Topic with any number of the client's subscriptions. Threads of ROS call `deliver` with their numbers."""

    def __init__(self, name: str, deliver: Callable[[tuple[int, ...], bytes], None]) -> None:
        self.name = name
        self._deliver = deliver
        self._numbers: tuple[int, ...] = ()
        self._changed = threading.Condition()
        self._received = 0
        self._latched: bytes | None = None

    @property
    @abstractmethod
    def is_connected(self) -> bool:
        """True if a publisher sends messages."""

    @property
    def is_wanted(self) -> bool:
        """True if there is a subscription."""
        return bool(self._numbers)

    def add(self, number: int) -> None:
        """Add a subscription; a latched message comes at once."""
        with self._changed:
            self._numbers = (*self._numbers, number)
            if self._latched is not None:
                self._deliver((number,), self._latched)

    def remove(self, number: int) -> bool:
        """Remove a subscription; return whether it was one of this topic."""
        with self._changed:
            was_there = number in self._numbers
            self._numbers = tuple(each for each in self._numbers if each != number)
        return was_there

    def wait_for(self, count: int, timeout: float) -> bool:
        """Wait until the publisher's first `count` messages have come; False after `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: self._received >= count, timeout)

    @abstractmethod
    def close(self) -> None:
        """Unsubscribe."""

    def take(self, data: bytes, received: int, *, is_latched: bool) -> None:
        """Take the publisher's message number `received`."""
        with self._changed:
            self._received = received
            if is_latched:
                self._latched = data
            self._deliver(self._numbers, data)
            self._changed.notify_all()


class PublishedTopic(ABC):
    """Topic that the client publishes; `published` is the number of messages as the cell counts them."""

    name: str
    type: str
    published: int

    @property
    @abstractmethod
    def is_connected(self) -> bool:
        """True if it has a subscriber."""

    @abstractmethod
    def publish(self, data: bytes) -> None:
        """Send a message."""


class Graph(ABC):
    """Nodes, topics and services of a ROS, for a relay; `encoding` is that of messages."""

    encoding: str

    @abstractmethod
    def is_over(self) -> bool:
        """True if the simulator has signed off; a GraphGoneError if nothing answers."""

    @abstractmethod
    def subscribe(
        self, name: str, type_name: str, deliver: Callable[[tuple[int, ...], bytes], None]
    ) -> SubscribedTopic:
        """Subscribe to a topic."""

    def settle(self, topic: SubscribedTopic) -> None:  # noqa: B027 - in ROS 1 the handshake does it
        """Wait in lockstep until all that a subscription is to get from now on will come."""

    def declare(self, type_name: str, description: dict[str, Any]) -> None:  # noqa: B027 - ROS 2 needs none
        """Note a type that the client will publish."""

    @abstractmethod
    def advertise(self, name: str, type_name: str) -> PublishedTopic | None:
        """Begin to publish; None if the type is not declared."""

    @abstractmethod
    def call(self, name: str, request: bytes, timeout: float | None) -> tuple[bool, bytes]:
        """Call a service; return True and the response, or False and the error, which may be empty.

        Raises:
            ServiceGoneError: the service cannot be reached, or has ended before it answered.
            GraphGoneError: nothing answers in the graph.
        """

    @abstractmethod
    def step(self, duration: int, counts: dict[str, int]) -> tuple[str, int, list[tuple[str, int]]]:
        """Let time pass in lockstep; errors as of `call`.

        Args:
            duration: [ns].
            counts: numbers of messages published, by topic.

        Returns:
            The error, empty for none; simulation time [ns]; numbers of messages of the cell by topic, of which the
            newest is the last.
        """
