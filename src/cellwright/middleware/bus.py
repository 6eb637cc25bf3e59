"""Bus of a cell or robot: topics and services inside the process, and a throttled count of refused input.

The cell names the topics that it publishes (`advertise`) and receives (`listen`), and its services (`serve`). Clients
of every kind `subscribe`, `publish` and `call`. All clients are equal, and a subscription never changes what the cell
does. Delivery is a plain loop in the order of subscription, within the publishing call. The bus is for one thread:
commands of other threads go through the simulation's inbox.
"""

from __future__ import annotations

import re
from base64 import b64decode, b64encode
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

from cellwright.middleware.messages import TYPES, Message, ServiceType, TypeSet, type_of
from cellwright.middleware.messages.conversions import shifted
from cellwright.middleware.messages.validation import describe_value
from cellwright.util.errors import CellwrightError, MessageError, RejectedCommandError, UnknownNameError, UsageError

if TYPE_CHECKING:
    from mujoco import MjModel

    from cellwright.engine.shapes import Visuals
    from cellwright.engine.simulation import Simulation

M = TypeVar("M", bound=Message)
E = TypeVar("E", bound=CellwrightError)

NANOSECONDS = 1_000_000_000
MAX_SOURCES = 256  # counted separately; all others share one count, which bounds memory (names come from outside)
OTHERS = "others"
MAX_LINES = 20  # reported in a second, over all sources; the rest is counted
MAX_LINE_LENGTH = 1000  # characters; a line contains names and values from outside
MAX_KINDS = 5  # reported in a second of one source
_MAX_SOURCE_LENGTH = 400
_VALUES = re.compile(r"[-+]?[0-9][0-9.e+-]*|'[^']*'|\"[^\"]*\"|\[[^]]*\]")
"""Numbers, quoted names and lists in a reason, which change from message to message."""


class Refusals:
    """Counter of refused input by source, with throttled reports.

    It reports the first refusal of its kind at once: of a source, for a reason whose numbers and quoted names do not
    count. It only counts those of the same kind that follow within a second of simulation time; the next report about
    the source has their number. With many sources or kinds at once, some are only counted as well.

    Args:
        now: returns simulation time [ns].
        report: takes a line.
    """

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now = now
        self._report = report
        self._counts: Counter[str] = Counter()
        self._recent: dict[tuple[str, str], int] = {}  # times of the newest lines [ns], by source and kind
        self._unreported: Counter[str] = Counter()
        self.newest_report: str | None = None
        """Addition of the newest refusal's report to its reason, which may be empty; None if it was only counted.
        A reader sets it back to None."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of refusals by source."""
        return MappingProxyType(self._counts)

    @property
    def total(self) -> int:
        """Total number of refusals."""
        return self._counts.total()

    def refuse(self, source: str, reason: str) -> None:
        """Count a refusal, and report it unless one of its kind was reported less than a second ago."""
        source = _one_line(source, _MAX_SOURCE_LENGTH)
        if source not in self._counts and len(self._counts) >= MAX_SOURCES:
            source = OTHERS
        self._counts[source] += 1
        if not self._is_due(source, reason):
            self._unreported[source] += 1
            self.newest_report = None
            return
        unreported = self._unreported.pop(source, 0)
        self.newest_report = f" (and {unreported} more since the last report)" if unreported else ""
        self._report(f"{_one_line(f'refused {source}: {reason}', MAX_LINE_LENGTH)}{self.newest_report}")

    def warn(self, source: str, text: str) -> None:
        """Report a line about input that was accepted and is probably a mistake, at most one of a kind a second."""
        source = _one_line(source, _MAX_SOURCE_LENGTH)
        if self._is_due(source, text):
            self._report(_one_line(f"{source}: {text}", MAX_LINE_LENGTH))

    def flush(self) -> None:
        """Report what was counted but not reported, as at the end of a run; of many sources only the first ones."""
        unreported = list(self._unreported.items())
        for source, count in unreported[:MAX_LINES]:
            self._report(f"refused {source}: {count} more since the last report")
        if rest := unreported[MAX_LINES:]:
            self._report(f"refused {sum(count for _, count in rest)} more, from {len(rest)} other sources")
        self._unreported.clear()

    def _is_due(self, source: str, text: str) -> bool:
        """Return whether to report a line now, which is then noted: none of its kind was reported within a second."""
        now = self._now()
        self._recent = {each: then for each, then in self._recent.items() if _is_recent(now, then)}
        kind = source, _VALUES.sub("", text[:MAX_LINE_LENGTH])
        of_source = sum(each == source for each, _ in self._recent)
        if kind in self._recent or of_source >= MAX_KINDS or len(self._recent) >= MAX_LINES:
            return False
        self._recent[kind] = now
        return True


def _is_recent(now: int, then: int) -> bool:
    """True if less than a second has passed [ns], and time has not restarted since."""
    return 0 <= now - then < NANOSECONDS


def _one_line(text: str, max_length: int) -> str:
    """Return a text cut to `max_length` characters, without characters that break a line."""
    short = text if len(text) <= max_length else f"{text[: max_length - 3]}..."
    return short if short.isprintable() else "".join(each if each.isprintable() else "?" for each in short)


class InputKind(StrEnum):
    """Kind of external input."""

    PUBLISH = "publish"
    CALL = "call"
    EXTRA = "extra"  # a service of the server itself, which bypasses the bus


@dataclass(frozen=True, slots=True)
class ExternalInput:
    """Message or request from outside for a topic or service; JSON values if it bypassed the bus."""

    kind: InputKind
    name: str
    message: Any
    node: str


class PendingResponse:
    """Pending response of a service: the service answers once, and the caller is notified.

    The response is a message; that of a service of the server itself is a JSON object.
    """

    def __init__(self) -> None:
        self.response: Any = None
        self._listeners: list[Callable[[Any], None]] = []

    def answer(self, response: Any) -> None:
        """Set the response; later ones are ignored."""
        if self.response is None:
            self.response = response
            for listener in self._listeners:
                listener(response)
            self._listeners.clear()

    def then(self, listener: Callable[[Any], None]) -> None:
        """Call `listener(response)` once the response exists: at once if it does already."""
        if self.response is None:
            self._listeners.append(listener)
        else:
            listener(self.response)


Callback: TypeAlias = Callable[[Any], None]  # takes a message of the topic's class

Handler: TypeAlias = Callable[[Any, str], Any]
"""Takes a message or request, and the name of the sending node."""


class Direction(Enum):
    """Direction of a topic, as seen from the cell."""

    OUT = "out"
    IN = "in"


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service of a topic, in the terms of ROS 2.

    A publisher that `is_reliable` sends lost messages again. A reliable subscription gets nothing from a publisher that
    is not reliable.
    """

    is_reliable: bool = True
    is_transient_local: bool = False  # true if a late subscriber gets the newest messages
    depth: int = 10  # messages that are kept

    @property
    def text(self) -> str:
        """Return the quality of service in words: "reliable, depth 10", "best effort, depth 1000"."""
        words = ["reliable" if self.is_reliable else "best effort"]
        words += ["transient local"] * self.is_transient_local
        return ", ".join([*words, f"depth {self.depth}"])


RELIABLE = Qos()
LATCHED = Qos(is_transient_local=True, depth=1)
COMMANDS = Qos(depth=1000)
"""Quality of service of what the cell receives. Messages may each command a part of the joints, so none may replace an
earlier one that waits; the depth is more than a program publishes at once. Publishers of any depth match."""
BEST_EFFORT_COMMANDS = Qos(is_reliable=False, depth=COMMANDS.depth)
"""The same for topics with publishers of both kinds: a best-effort subscription receives from reliable ones, too."""
LARGE = Qos(depth=2)
"""Quality of service of pictures and point clouds: of such large messages, best effort loses most in ROS 2."""


class Subscription:
    """Subscription of a callback to every message of a topic, until it is cancelled."""

    def __init__(
        self, topic: Topic, callback: Callback, node: str, origin: str | None, since: int, *, passive: bool
    ) -> None:
        self._topic = topic
        self.since = since  # simulation time [ns] of its start, or -1 after time has restarted
        self.is_passive = passive  # it gets what is built for others, and does not count as a listener
        self.callback = callback
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
        self._count = 0
        self.node = node
        self.latch = latch
        self.on_listeners = on_listeners
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
        if self.latch:
            self._newest = message
        elif measured is not None and measured <= self._newest_since:
            for subscription in self._topic.subscriptions_to(self.node):
                if subscription.since < measured:
                    subscription.callback(message)
            return
        for callback in self._callbacks:
            callback(message)

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
        self._newest_since = max((each.since for each in subscriptions), default=-1)
        self._count = sum(not each.is_passive for each in subscriptions)
        if self.on_listeners is not None and self._callbacks != before:
            self.on_listeners(self._count)


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


@dataclass(frozen=True, slots=True)
class Service:
    """Service, and the node that serves it."""

    name: str
    type: ServiceType
    handler: Handler
    node: str


class Bus:
    """Topics and services inside the process.

    Args:
        now: returns simulation time [ns].
        report: takes a line about refused input, see `Refusals`.
        types: set of types of all topics and services.
    """

    def __init__(
        self, now: Callable[[], int], report: Callable[[str], None] = lambda _line: None, types: TypeSet = TYPES
    ) -> None:
        self.types = types
        self._topics: dict[str, Topic] = {}
        self._services: dict[str, Service] = {}
        self.actions: dict[str, str] = {}
        """Type of each action by name; the topics below its name are those of ROS 1, and ROS 2 has its own."""
        self._now = now
        self.refusals = Refusals(now, report)
        self.on_input: list[Callable[[ExternalInput], None]] = []
        """Called with all external input that has a handler, before it is handled, even if it is refused then."""
        self.on_notice: list[Callable[[str], None]] = []
        """Called with each line about input that was carried out only in part, or held back; refusals are apart."""

    def advertise(
        self,
        topic: str,
        type_name: str,
        *,
        latch: bool = False,
        rate: str = "",
        node: str = "",
        on_listeners: Callable[[int], None] | None = None,
        qos: Qos | None = None,
    ) -> Publisher:
        """Create a publisher for a topic; a topic may have several. See `Publisher` for latch and on_listeners.

        In ROS 2 it has the quality of service `qos`; by default it is reliable, and transient local with latch.

        Raises:
            UnknownNameError: there is no message type of this name.
            UsageError: the name is not absolute, the topic has another type or direction already, or latch and
                on_listeners are both given.
        """
        entry = self._topic(topic)
        entry.declare(self.types.message(type_name), Direction.OUT, rate, qos or (LATCHED if latch else RELIABLE))
        publisher = Publisher(entry, node, on_listeners, latch=latch)
        entry.publishers.append(publisher)
        publisher.update_listeners()  # a subscription may exist already
        return publisher

    def listen(self, topic: str, type_name: str, handler: Handler, *, node: str = "", qos: Qos | None = None) -> None:
        """Call `handler(message, node)` for what clients publish on a topic; it refuses with a RejectedCommandError.

        In ROS 2 it subscribes with the quality of service `qos`; by default it is reliable.

        Raises:
            UnknownNameError: there is no message type of this name.
            UsageError: the name is not absolute, or the topic is declared already.
        """
        entry = self._topic(topic)
        if entry.direction is not None:
            raise UsageError(f"{topic} is already declared as {entry.direction.value}put of {entry.type}")
        entry.declare(self.types.message(type_name), Direction.IN, "", qos or RELIABLE)
        entry.handler, entry.handling_node = handler, node

    def serve(self, service: str, type_name: str, handler: Handler, *, node: str = "") -> None:
        """Answer calls of a service: `handler(request, node) -> response`.

        It may raise a ServiceFailedError: then the call has no answer. For a response that takes simulation time, the
        handler returns a `PendingResponse` and answers it afterwards.

        Raises:
            UnknownNameError: there is no service type of this name.
            UsageError: the name is not absolute, or the service exists already.
        """
        if absolute(service) in self._services:
            raise UsageError(f"service {service} already exists")
        self._services[service] = Service(service, self.types.service(type_name), handler, node)

    def forget_latched(self) -> None:
        """Forget all latched messages, as when a run restarts; subscriptions stay, as if they had always existed."""
        for topic in self._topics.values():
            for subscription in topic.subscriptions:
                subscription.since = -1
            for publisher in topic.publishers:
                publisher.newest = None
                publisher.update_listeners()

    def latched(self, clock_offset: int = 0) -> dict[str, list[str | None]]:
        """Return the newest messages of all latched topics as JSON values: CDR in base64, by topic and publisher.

        Their stamps are in the time of the run: by `clock_offset` [ns] before message time.
        """
        found = {}
        for name, topic in sorted(self._topics.items()):
            newest = [publisher.newest for publisher in topic.publishers if publisher.latch]
            if any(message is not None for message in newest):
                found[name] = [None if each is None else self._latched_text(each, -clock_offset) for each in newest]
        return found

    def set_latched(self, state: Mapping[str, Sequence[str | None]], clock_offset: int = 0) -> None:
        """Replace all latched messages by what `latched` returned; nothing is delivered to listeners."""
        for name, topic in self._topics.items():
            publishers = [publisher for publisher in topic.publishers if publisher.latch]
            for publisher, text in zip(publishers, state.get(name, [None] * len(publishers)), strict=True):
                known = topic.message_class
                message = None if text is None or known is None else self.types.from_cdr(b64decode(text), known)
                publisher.newest = message and shifted(message, clock_offset)

    def deliver_latched(self) -> None:
        """Deliver all latched messages once more: the run has gone back to a time when they were the newest."""
        for topic in self._topics.values():
            for publisher in topic.publishers:
                if publisher.latch and (newest := publisher.newest) is not None:
                    for subscription in topic.subscriptions_to(publisher.node):
                        subscription.callback(newest)

    def subscribe(
        self, topic: str, callback: Callback, *, node: str = "", origin: str | None = None, passive: bool = False
    ) -> Subscription:
        """Call `callback(message)` for each message of a topic, in either direction.

        The topic need not exist yet. On a latched topic the newest message comes at once.

        Args:
            topic: absolute name.
            callback: takes a message.
            node: name of the subscribing node.
            origin: deliver only what publishers of this node publish.
            passive: get what is built for others. Messages that are built only for listeners are not built for it.

        Raises:
            UsageError: the name is not absolute.
        """
        entry = self._topic(topic)
        subscription = Subscription(entry, callback, node, origin, self._now(), passive=passive)
        entry.add(subscription)
        return subscription

    def publish(self, topic: str, message: Message, *, node: str = "", is_decoded: bool = False) -> None:
        """Send the cell a message: the handler gets it first, then the subscribers, even if it was refused.

        Args:
            topic: absolute name.
            message: message of the topic's type.
            node: name of the sending node.
            is_decoded: the message was just decoded from bytes; do not validate its fields again.

        Raises:
            UnknownNameError: the cell does not listen to such a topic.
            RejectedCommandError: the message does not fit the topic, or was refused; it had no effect then.
        """
        entry = self._topics.get(topic)
        if entry is None or entry.handler is None or entry.message_class is None:
            listened = sorted(each.name for each in self._topics.values() if each.handler is not None)
            raise self._refused(topic, node, UnknownNameError("topic to publish on", topic, listened))
        try:
            valid = self._validated(message, entry.message_class, topic, is_decoded)
        except RejectedCommandError as error:
            raise self._refused(topic, node, error) from None
        if self.on_input:
            self.note(ExternalInput(InputKind.PUBLISH, topic, valid, node))
        refusal: RejectedCommandError | None = None
        try:
            entry.handler(valid, node)
        except RejectedCommandError as error:
            refusal = error
        for subscription in entry.subscriptions_to(node):
            subscription.callback(valid)
        if refusal is not None:
            raise self._refused(topic, node, refusal)

    def call(self, service: str, request: Message, *, node: str = "", is_decoded: bool = False) -> Any:
        """Call a service; return its response, or a `PendingResponse` if the response takes simulation time.

        Raises:
            UnknownNameError: there is no such service.
            RejectedCommandError: the request does not fit the service, or was refused; it had no effect then.
            ServiceFailedError: the service gave no answer.
        """
        try:
            entry = self.service(service)
        except UnknownNameError as error:
            raise self._refused(service, node, error) from None
        try:
            valid = self._validated(request, entry.type.request, service, is_decoded)
            if self.on_input:
                self.note(ExternalInput(InputKind.CALL, service, valid, node))
            response = entry.handler(valid, node)
        except RejectedCommandError as error:
            raise self._refused(service, node, error) from None
        if isinstance(response, PendingResponse):
            return response
        if type(response) is not entry.type.response:
            raise UsageError(
                f"{service} must answer with {type_of(entry.type.response)}, not {describe_value(response)}"
            )
        return response

    def note(self, external_input: ExternalInput) -> None:
        """Report external input to `on_input`; for input that bypasses the bus, before it is carried out."""
        for callback in self.on_input:
            callback(external_input)

    def topics(self) -> tuple[TopicInfo, ...]:
        """Return all topics that the cell publishes or receives, by name."""
        return tuple(self.topic(name) for name in sorted(self._declared()))

    def topic(self, name: str) -> TopicInfo:
        """Return the current state of a topic; an UnknownNameError if there is none."""
        entry = self._topics.get(name)
        if entry is None or entry.direction is None:
            raise UnknownNameError("topic", name, sorted(self._declared()))
        subscribers = [each.node for each in entry.subscriptions]
        if entry.handler is not None:
            subscribers.insert(0, entry.handling_node)
        return TopicInfo(
            name,
            entry.type,
            entry.direction,
            entry.rate,
            entry.qos,
            any(publisher.latch for publisher in entry.publishers),
            tuple(publisher.node for publisher in entry.publishers),
            tuple(subscribers),
        )

    def services(self) -> tuple[Service, ...]:
        """Return all services, by name."""
        return tuple(self._services[name] for name in sorted(self._services))

    def service(self, name: str) -> Service:
        """Return a service; an UnknownNameError if there is none."""
        if name not in self._services:
            raise UnknownNameError("service", name, sorted(self._services))
        return self._services[name]

    def _declared(self) -> list[str]:
        return [topic.name for topic in self._topics.values() if topic.direction is not None]

    def _topic(self, name: str) -> Topic:
        entry = self._topics.get(name)
        if entry is None:
            entry = self._topics[absolute(name)] = Topic(name)
        return entry

    def _latched_text(self, message: Message, shift: int) -> str:
        """Return a message as CDR in base64, its stamps shifted [ns]."""
        return b64encode(self.types.to_cdr(shifted(message, shift) if shift else message)).decode()

    def _validated(self, message: M, message_class: type[Message], name: str, is_decoded: bool) -> M:  # noqa: FBT001
        """Return a valid message; a MessageError if it is of another class, or a field does not fit."""
        if type(message) is not message_class:
            raise MessageError(f"{name} takes {type_of(message_class)}, not {describe_value(message)}")
        if is_decoded and not self.types.has_bounds(message_class.__msgtype__):
            return message
        return self.types.checked(message)

    def _refused(self, name: str, node: str, error: E) -> E:
        """Count and report a refusal; return the error, for the caller to raise."""
        self.refusals.refuse(f"{name} from {node}" if node else name, str(error))
        return error


class Node(Protocol):
    """Node with topics, services and simulation time: a cell, or a robot's controller node."""

    @property
    def name(self) -> str:
        """Displayed name: of the trial or the robot."""

    @property
    def bus(self) -> Bus:
        """Topics and services."""

    @property
    def simulation(self) -> Simulation:
        """Simulation that advances time."""

    @property
    def drawn(self) -> tuple[MjModel, Visuals]:
        """Model whose shapes are drawn, with the bodies of the simulation's, and more shapes on these bodies."""

    @property
    def in_competition(self) -> bool:
        """True in competition mode."""

    def scene_parts(self) -> tuple[tuple[str, int, bool], ...]:
        """Return name, engine's body and visibility of each part of a cell; see `SceneCapture`."""


def absolute(name: str) -> str:
    """Return the name itself; a UsageError unless it is absolute."""
    if not name.startswith("/") or name.endswith("/") or "//" in name or any(letter.isspace() for letter in name):
        raise UsageError(f"{name!r} is not an absolute name; write it like '/ariac/orders'")
    return name
