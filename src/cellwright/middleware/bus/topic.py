"""Topics: their declaration, publishers and subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

from cellwright.middleware.bus.qos import RELIABLE, Qos
from cellwright.middleware.messages import Message, type_of
from cellwright.middleware.messages.validation import describe_value
from cellwright.util.errors import UsageError

Callback: TypeAlias = Callable[[Any], None]  # takes a message of the topic's class

Handler: TypeAlias = Callable[[Any, str], Any]
"""Takes a message or request, and the name of the sending node."""


class Direction(Enum):
    """Direction of a topic, as seen from the cell."""

    OUT = "out"
    IN = "in"


class Topic:
    """Topic with messages of one type. Without a type it has only subscribers that wait for it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.type = ""
        self.message_class: type[Message] | None = None
        self.direction: Direction | None = None
        self.rate = ""
        self.qos = RELIABLE
        self.publishers: list[Publisher] = []
        self.handler: Handler | None = None
        self.handling_node = ""
        self.subscriptions: list[Subscription] = []

    def declare(self, message_class: type[Message], direction: Direction, rate: str, qos: Qos) -> None:
        """Set type, direction and quality of service; a UsageError if they were set to something else before."""
        type_name = type_of(message_class)
        if self.direction is not None and (self.message_class, self.direction) != (message_class, direction):
            raise UsageError(
                f"{self.name} is declared as {self.direction.value}put of {self.type}, "
                f"not as {direction.value}put of {type_name}"
            )
        self.type = type_name
        self.message_class = message_class
        self.direction = direction
        self.rate, self.qos = self.rate or rate, qos

    def add(self, subscription: Subscription) -> None:
        """Add a subscription; latched messages come first."""
        self.subscriptions.append(subscription)
        for publisher in self.publishers:
            if subscription.origin in (None, publisher.node) and (newest := publisher.newest) is not None:
                subscription.callback(newest)
        self._notify_publishers()

    def forget_latched(self) -> None:
        """Forget the latched messages; subscriptions stay, as if they had always existed."""
        for subscription in self.subscriptions:
            subscription.since = -1
        for publisher in self.publishers:
            publisher.newest = None
            publisher.update_listeners()

    def remove(self, subscription: Subscription) -> None:
        """Remove a subscription."""
        if subscription in self.subscriptions:
            self.subscriptions.remove(subscription)
            self._notify_publishers()

    def subscriptions_to(self, node: str) -> list[Subscription]:
        """Return the subscriptions to what a node publishes here."""
        return [each for each in self.subscriptions if each.origin in (None, node)]

    def _notify_publishers(self) -> None:
        for publisher in self.publishers:
            publisher.update_listeners()


class Subscription:
    """Subscription of a callback to every message of a topic, until it is cancelled."""

    def __init__(
        self,
        topic: Topic,
        callback: Callback,
        node: str,
        origin: str | None,
        since: int,
        *,
        passive: bool,
        take_cdr: Callable[[bytes], None] | None,
    ) -> None:
        self._topic = topic
        self.since = since  # simulation time [ns] of its start, or -1 after time has restarted
        self.is_passive = passive  # it gets what is built for others, and does not count as a listener
        self.callback = callback
        self.take_cdr = take_cdr  # called in place of `callback`, with CDR, if no listener needs the message itself
        self.node = node
        self.origin = origin

    def cancel(self) -> None:
        """End the subscription; a second call has no effect. A message in delivery may still arrive."""
        self._topic.remove(self)


class Publisher:
    """Publisher of a topic; calls `on_listeners` with the number of listeners whenever it changes.

    With `latch` a late listener gets the newest message. Such a topic is published even without listeners, since the
    newest message must not depend on them.

    Raises:
        UsageError: latch and on_listeners are both given.
    """

    def __init__(self, topic: Topic, node: str, on_listeners: Callable[[int], None] | None, *, latch: bool) -> None:
        if latch and on_listeners is not None:
            raise UsageError(f"{topic.name}: a latched topic is published even without listeners; omit on_listeners")
        self._topic = topic
        self._class = topic.message_class
        self._callbacks: tuple[Callback, ...] = ()
        self._newest_since = -1  # simulation time [ns] at which the latest subscription began
        self.cdr_takers: tuple[Callable[[bytes], None], ...] = ()
        """Functions that take the next message as CDR, if that suits all listeners; empty if one needs the message, or
        there is none."""
        self._count = 0
        self.node = node
        self.latch = latch
        self.is_state = latch
        """True if its newest message is part of the state of a run."""
        self.on_listeners = on_listeners
        self.saved: tuple[Message, int, str] | None = None
        """The message that was saved last with the state of a run, the shift of its stamps [ns], and its text."""
        self._newest: Message | Callable[[], Message | None] | None = None

    @property
    def newest(self) -> Message | None:
        """Newest message of a latched topic, built now if it was not needed before."""
        if callable(self._newest):
            self._newest = self._newest()
        return self._newest

    @newest.setter
    def newest(self, message: Message | None) -> None:
        self._newest = message

    def forget(self) -> None:
        """Forget the newest message of its topic."""
        self._topic.forget_latched()

    @property
    def listeners(self) -> int:
        """Number of listeners to this publisher, without passive ones."""
        return self._count

    def publish(self, message: Message, *, measured: int | None = None) -> None:
        """Deliver a message to every listener, in the order of subscription.

        The message must not change from here on. Errors of listeners propagate: listeners are transports, which handle
        their clients' errors.

        Args:
            message: message of the topic's class.
            measured: simulation time [ns] of a message that was sampled earlier. Listeners that began later do not get
                it, as if the topic had had no listener before them.

        Raises:
            UsageError: the message is not of the topic's class.
        """
        if type(message) is not self._class:
            raise UsageError(f"{self._topic.name} carries {self._topic.type}, not {describe_value(message)}")
        # A reading that was measured before a subscription began would not exist without an earlier listener: then
        # what one client gets would depend on another.
        if self.latch:
            self._newest = message
        elif measured is not None and measured <= self._newest_since:
            for subscription in self._topic.subscriptions_to(self.node):
                if subscription.since < measured:
                    subscription.callback(message)
            return
        for callback in self._callbacks:
            callback(message)

    def publish_cdr(self, encode: Callable[[], bytes], build: Callable[[], Message | None], measured: int) -> bool:
        """Deliver a measured message as CDR, if that suits all listeners; return whether it was delivered.

        Args:
            encode: returns its CDR.
            build: returns the message itself, at any time, for late listeners of a latched topic.
            measured: as in `publish`.
        """
        if not self.cdr_takers or (not self.latch and measured <= self._newest_since):
            return False
        if self.latch:
            self._newest = build
        data = encode()
        for take in self.cdr_takers:
            take(data)
        return True

    def offer(self, build: Callable[[], Message | None]) -> None:
        """Publish the result of `build` on a latched topic; without a listener, build it when it is needed.

        `build` must return the same message at any time, or None for no message.
        """
        if not self._callbacks:
            self._newest = build
        elif (message := build()) is not None:
            self.publish(message)

    def update_listeners(self) -> None:
        """Update the listeners, and report their number to `on_listeners` if they changed."""
        before = self._callbacks
        subscriptions = self._topic.subscriptions_to(self.node)
        self._callbacks = tuple(each.callback for each in subscriptions)
        takers = [each.take_cdr for each in subscriptions if each.take_cdr is not None]
        self.cdr_takers = tuple(takers) if len(takers) == len(subscriptions) else ()
        self._newest_since = max((each.since for each in subscriptions), default=-1)
        self._count = sum(not each.is_passive for each in subscriptions)
        if self.on_listeners is not None and self._callbacks != before:
            self.on_listeners(self._count)


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """Current state of a topic: `rate` in words, publishers and subscribers by node."""

    name: str
    type: str
    direction: Direction
    rate: str
    qos: Qos
    latch: bool
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]


def absolute(name: str) -> str:
    """Return the name itself; a UsageError unless it is absolute."""
    if not name.startswith("/") or name.endswith("/") or "//" in name or any(letter.isspace() for letter in name):
        raise UsageError(f"{name!r} is not an absolute name; write it like '/joint_states'")
    return name
