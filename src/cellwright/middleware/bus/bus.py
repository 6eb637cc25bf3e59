"""Bus of a cell or robot: topics and services by name, and a throttled count of refused input.

The cell advertises what it says (`advertise`), names what it hears (`listen`) and what it does on request (`serve`).
Clients of every kind `subscribe`, `publish` and `call`; each is an equal guest, and none changes what the cell does by
listening. Delivery is a plain loop in the order of subscription, within the publishing call; nothing here is for more
than one thread (commands of other threads go through the simulation's inbox).
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections import Counter, deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from cellwright.middleware.bus.topics import (
    Callback,
    Direction,
    Given,
    Handler,
    How,
    Later,
    Publisher,
    Subscription,
    Topic,
)
from cellwright.middleware.messages import Message, ServiceType, checked, from_cdr, said, service_type, to_cdr, type_of
from cellwright.middleware.messages.validation import has_bounds
from cellwright.util.errors import CellwrightError, MessageError, RejectedCommandError, UnknownNameError, UsageError

if TYPE_CHECKING:
    from cellwright.engine.simulation import Simulation

NANOSECONDS = 1_000_000_000
MOST_SOURCES = 256
"""So many sources are told apart; names come from outside, and must not eat the memory. The others share one."""
OTHERS = "others"
MOST_LINES = 20
"""So many lines at most are said in a second, whatever the sources call themselves; the rest is counted."""
LONGEST_LINE = 1000
"""Characters of a line at most: names and values in it come from outside."""

_LONGEST_SOURCE = 400


class Refusals:
    """Counts refused input by source, and reports it.

    The first refusal of a source is reported at once; those that follow within a second of simulation time are only
    counted, and their number is told with the next report. Of many sources at once some are only counted as well.

    Args:
        now: simulation time [ns].
        report: takes the line to be logged.
    """

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now = now
        self._report = report
        self._counts: Counter[str] = Counter()
        self._reported: dict[str, int] = {}
        self._untold: Counter[str] = Counter()
        self._said: deque[int] = deque(maxlen=MOST_LINES)  # when the newest lines were said [ns]

    @property
    def counts(self) -> Mapping[str, int]:
        """How much was refused, by source."""
        return MappingProxyType(self._counts)

    @property
    def total(self) -> int:
        """How much was refused in all."""
        return self._counts.total()

    def refuse(self, source: str, reason: str) -> None:
        """Count a refusal, and report it unless one from the same source was reported less than a second ago."""
        source = _one_line(source, _LONGEST_SOURCE)
        if source not in self._counts and len(self._counts) >= MOST_SOURCES:
            source = OTHERS
        self._counts[source] += 1
        now = self._now()
        last = self._reported.get(source)
        if _is_recent(now, last) or (len(self._said) == MOST_LINES and _is_recent(now, self._said[0])):
            self._untold[source] += 1
            return
        self._said.append(now)
        untold = self._untold.pop(source, 0)
        self._reported[source] = now
        more = f" (and {untold} more since the last report)" if untold else ""
        self._report(f"{_one_line(f'refused {source}: {reason}', LONGEST_LINE)}{more}")

    def flush(self) -> None:
        """Report what was counted and not told yet, as at the end of a run; of many sources the first ones."""
        untold = list(self._untold.items())
        for source, count in untold[:MOST_LINES]:
            self._report(f"refused {source}: {count} more since the last report")
            self._reported[source] = self._now()
        if rest := untold[MOST_LINES:]:
            self._report(f"refused {sum(count for _, count in rest)} more, from {len(rest)} other sources")
        self._untold.clear()


def _is_recent(now: int, then: int | None) -> bool:
    """Whether less than a second has passed [ns]; not when time has begun anew since."""
    return then is not None and 0 <= now - then < NANOSECONDS


def _one_line(text: str, most: int) -> str:
    """A text that breaks no line, however long its names are and whatever is in them."""
    short = text if len(text) <= most else f"{text[: most - 3]}..."
    return short if short.isprintable() else "".join(each if each.isprintable() else "?" for each in short)


M = TypeVar("M", bound=Message)
E = TypeVar("E", bound=CellwrightError)


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic as it stands: `rate` in words, publishers and subscribers by node."""

    name: str
    type: str
    direction: Direction
    rate: str
    latch: bool
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ServiceInfo:
    """A service as it stands, and the node that serves it."""

    name: str
    type: str
    node: str


@dataclass(frozen=True, slots=True)
class _Service:
    type: ServiceType
    handler: Handler
    node: str


class Bus:
    """Topics and services inside the process.

    Args:
        now: simulation time [ns].
        report: takes a line about refused input (see `Refusals`).
    """

    def __init__(self, now: Callable[[], int], report: Callable[[str], None] = lambda _line: None) -> None:
        self._topics: dict[str, Topic] = {}
        self._services: dict[str, _Service] = {}
        self._now = now
        self.refusals = Refusals(now, report)
        self.on_given: list[Callable[[Given], None]] = []
        """Called with everything that comes from outside and could be handled, before it is, refused then or not."""

    def advertise(
        self,
        topic: str,
        type_name: str,
        *,
        latch: bool = False,
        rate: str = "",
        node: str = "",
        on_listeners: Callable[[int], None] | None = None,
    ) -> Publisher:
        """Make a publisher for a topic; a topic may have several. See `Publisher` for latch and on_listeners.

        Raises:
            UnknownNameError: there is no message type of this name.
            UsageError: the name is not absolute, the topic has another type or direction already, or latch and
                on_listeners are both given.
        """
        entry = self._topic(topic)
        entry.declare(type_name, Direction.OUT, rate)
        publisher = Publisher(entry, node, on_listeners, latch=latch)
        entry.add_publisher(publisher)
        return publisher

    def listen(self, topic: str, type_name: str, handler: Handler, *, node: str = "") -> None:
        """Hear what clients publish on a topic: `handler(message, node)`; it refuses with a RejectedCommandError.

        Raises:
            UnknownNameError: there is no message type of this name.
            UsageError: the name is not absolute, or the topic is taken.
        """
        entry = self._topic(topic)
        if entry.direction is not None:
            raise UsageError(f"{topic} is taken: it carries {entry.type} {entry.direction.value}")
        entry.declare(type_name, Direction.IN, "")
        entry.handler, entry.handling_node = handler, node

    def serve(self, service: str, type_name: str, handler: Handler, *, node: str = "") -> None:
        """Answer calls of a service: `handler(request, node) -> response`.

        It may raise a ServiceFailedError: then the call has no answer. Where some time has to pass first, the handler
        returns a `Later` that it answers then.

        Raises:
            UnknownNameError: there is no service type of this name.
            UsageError: the name is not absolute, or the service is served already.
        """
        if absolute(service) in self._services:
            raise UsageError(f"the service {service} is served already")
        self._services[service] = _Service(service_type(type_name), handler, node)

    def forget_latched(self) -> None:
        """Forget all latched messages, as when a run begins anew; who listens has listened all along."""
        for topic in self._topics.values():
            for publisher in topic.publishers:
                publisher.newest = None
            for subscription in topic.subscriptions:
                subscription.since = -1

    def latched(self) -> dict[str, list[str | None]]:
        """The newest messages of all latched topics, as JSON values: CDR in base64, by topic and publisher."""
        found = {}
        for name, topic in sorted(self._topics.items()):
            newest = [publisher.newest for publisher in topic.publishers if publisher.latch]
            if any(message is not None for message in newest):
                found[name] = [None if each is None else b64encode(to_cdr(each)).decode() for each in newest]
        return found

    def set_latched(self, state: Mapping[str, Sequence[str | None]]) -> None:
        """Take over what `latched` returned, in place of all that was latched; listeners get nothing for it."""
        for name, topic in self._topics.items():
            publishers = [publisher for publisher in topic.publishers if publisher.latch]
            for publisher, text in zip(publishers, state.get(name, [None] * len(publishers)), strict=True):
                known = topic.message_class
                publisher.newest = None if text is None or known is None else from_cdr(b64decode(text), known)

    def subscribe(
        self, topic: str, callback: Callback, *, node: str = "", origin: str | None = None, along: bool = False
    ) -> Subscription:
        """Have `callback(message)` called for each message of a topic, in either direction.

        A topic that is not there yet is waited for. On a latched one the newest message comes at once. With an
        `origin` only what publishers of that node say is delivered. Who listens `along` gets what is made for others:
        what is made only while somebody listens is not made for it.

        Raises:
            UsageError: the name is not absolute.
        """
        entry = self._topic(topic)
        subscription = Subscription(entry, callback, node, origin, self._now(), along=along)
        entry.add(subscription)
        return subscription

    def publish(self, topic: str, message: Message, *, node: str = "", is_decoded: bool = False) -> None:
        """Give the cell a message: first it is handled, then those who listen in get it, refused or not.

        Args:
            topic: absolute name.
            message: of the topic's class.
            node: whom it comes from.
            is_decoded: the message was decoded from bytes just now: its fields are not validated again.

        Raises:
            UnknownNameError: the cell does not listen to such a topic.
            RejectedCommandError: the message is not what the topic carries, or was refused; nothing was done then.
        """
        entry = self._topics.get(topic)
        if entry is None or entry.handler is None or entry.message_class is None:
            listened = sorted(each.name for each in self._topics.values() if each.handler is not None)
            raise self._refused(topic, node, UnknownNameError("topic to publish on", topic, listened))
        try:
            taken = _fitting(message, entry.message_class, topic, is_decoded)
        except RejectedCommandError as error:
            raise self._refused(topic, node, error) from None
        if self.on_given:
            self.note(Given(How.PUBLISH, topic, taken, node))
        refusal: RejectedCommandError | None = None
        try:
            entry.handler(taken, node)
        except RejectedCommandError as error:
            refusal = error
        for subscription in entry.subscriptions_to(node):
            subscription.callback(taken)
        if refusal is not None:
            raise self._refused(topic, node, refusal)

    def call(self, service: str, request: Message, *, node: str = "", is_decoded: bool = False) -> Any:
        """Call a service; its response, or a `Later` that will have it when some time has passed.

        Args as in `publish`.

        Raises:
            UnknownNameError: there is no such service.
            RejectedCommandError: the request is not what the service takes, or was refused; nothing was done then.
            ServiceFailedError: the service gave no answer.
        """
        entry = self._services.get(service)
        if entry is None:
            raise self._refused(service, node, UnknownNameError("service", service, sorted(self._services)))
        try:
            taken = _fitting(request, entry.type.request, service, is_decoded)
            if self.on_given:
                self.note(Given(How.CALL, service, taken, node))
            response = entry.handler(taken, node)
        except RejectedCommandError as error:
            raise self._refused(service, node, error) from None
        if isinstance(response, Later):
            return response
        if type(response) is not entry.type.response:
            raise UsageError(f"{service} must answer with {type_of(entry.type.response)}, not {said(response)}")
        return response

    def note(self, given: Given) -> None:
        """Tell those who take notes of what comes from outside; for what comes past the bus, before it is done."""
        for take_note in self.on_given:
            take_note(given)

    def topics(self) -> tuple[TopicInfo, ...]:
        """All topics that the cell speaks or hears, by name."""
        return tuple(self.topic(name) for name in sorted(self._declared()))

    def topic(self, name: str) -> TopicInfo:
        """One topic as it stands.

        Raises:
            UnknownNameError: there is no such topic.
        """
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
            any(publisher.latch for publisher in entry.publishers),
            tuple(publisher.node for publisher in entry.publishers),
            tuple(subscribers),
        )

    def services(self) -> tuple[ServiceInfo, ...]:
        """All services, by name."""
        return tuple(self.service(name) for name in sorted(self._services))

    def service(self, name: str) -> ServiceInfo:
        """One service as it stands.

        Raises:
            UnknownNameError: there is no such service.
        """
        entry = self._services.get(name)
        if entry is None:
            raise UnknownNameError("service", name, sorted(self._services))
        return ServiceInfo(name, entry.type.name, entry.node)

    def _declared(self) -> list[str]:
        return [topic.name for topic in self._topics.values() if topic.direction is not None]

    def _topic(self, name: str) -> Topic:
        entry = self._topics.get(name)
        if entry is None:
            entry = self._topics[absolute(name)] = Topic(name)
        return entry

    def _refused(self, name: str, node: str, error: E) -> E:
        """Count and report what was refused; the error, to be raised."""
        self.refusals.refuse(f"{name} from {node}" if node else name, str(error))
        return error


class Served(Protocol):
    """Whatever has topics and services, and time that passes: a cell, or a robot's controller node."""

    @property
    def name(self) -> str:
        """What it is called where one is told of it: the trial, the robot."""
        ...

    @property
    def bus(self) -> Bus:
        """Its topics and services."""
        ...

    @property
    def simulation(self) -> Simulation:
        """Its time."""
        ...

    @property
    def in_competition(self) -> bool:
        """Whether what a competition refuses is refused."""
        ...

    def out_of_sight(self) -> Collection[int]:
        """The engine's ids of bodies that are not there to be seen at the moment, such as parts out of play."""
        ...


def _fitting(message: M, message_class: type[Message], name: str, is_decoded: bool) -> M:  # noqa: FBT001
    """The message as the cell may take it.

    Raises:
        MessageError: it is of another class, or a field holds what it should not.
    """
    if type(message) is not message_class:
        raise MessageError(f"{name} takes {type_of(message_class)}, not {said(message)}")
    return message if is_decoded and not has_bounds(message_class.__msgtype__) else checked(message)


def absolute(name: str) -> str:
    """The name itself, if it is absolute.

    Raises:
        UsageError: it is not.
    """
    if not name.startswith("/") or name.endswith("/") or "//" in name or any(letter.isspace() for letter in name):
        raise UsageError(f"{name!r} is no absolute name: it must look like '/ariac/orders'")
    return name
