"""Bus of a cell or robot: topics and services inside the process.

The cell names the topics that it publishes (`advertise`) and receives (`listen`), and its services (`serve`). Clients
of every kind `subscribe`, `publish` and `call`. All clients are equal, and a subscription never changes what the cell
does. Delivery is a plain loop in the order of subscription, within the publishing call. The bus is for one thread:
commands of other threads go through the simulation's inbox.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from cellwright.middleware.bus.qos import LATCHED, RELIABLE, Qos
from cellwright.middleware.bus.refusals import Refusals
from cellwright.middleware.bus.topic import (
    Callback,
    Direction,
    Handler,
    Publisher,
    Subscription,
    Topic,
    TopicInfo,
    absolute,
)
from cellwright.middleware.messages import TYPES, Message, ServiceType, TypeSet, type_of
from cellwright.middleware.messages.conversions import shifted
from cellwright.middleware.messages.validation import describe_value
from cellwright.util.errors import CellwrightError, MessageError, RejectedCommandError, UnknownNameError, UsageError

if TYPE_CHECKING:
    from cellwright.engine.simulation import Simulation

M = TypeVar("M", bound=Message)
E = TypeVar("E", bound=CellwrightError)


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
            topic.forget_latched()

    def latched(self, clock_offset: int = 0) -> dict[str, list[str | None]]:
        """Return the newest latched messages that are state, as JSON values: CDR in base64, by topic and publisher.

        Their stamps are in the time of the run: by `clock_offset` [ns] before message time.
        """
        found = {}
        for name, topic in sorted(self._topics.items()):
            texts = [self._latched_text(each, -clock_offset) for each in topic.publishers if each.is_state]
            if any(text is not None for text in texts):
                found[name] = texts
        return found

    def set_latched(self, state: Mapping[str, Sequence[str | None]], clock_offset: int = 0) -> None:
        """Replace the latched messages that are state by what `latched` returned; nothing is delivered to listeners."""
        for name, topic in self._topics.items():
            publishers = [publisher for publisher in topic.publishers if publisher.is_state]
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
        self,
        topic: str,
        callback: Callback,
        *,
        node: str = "",
        origin: str | None = None,
        passive: bool = False,
        take_cdr: Callable[[bytes], None] | None = None,
    ) -> Subscription:
        """Call `callback(message)` for each message of a topic, in either direction.

        The topic need not exist yet. On a latched topic the newest message comes at once.

        Args:
            topic: absolute name.
            callback: takes a message.
            node: name of the subscribing node.
            origin: deliver only what publishers of this node publish.
            passive: get what is built for others. Messages that are built only for listeners are not built for it.
            take_cdr: takes a message as CDR, in place of `callback`: so no message need be built for the bytes alone.

        Raises:
            UsageError: the name is not absolute.
        """
        entry = self._topic(topic)
        subscription = Subscription(entry, callback, node, origin, self._now(), passive=passive, take_cdr=take_cdr)
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
        # As in ROS, subscribers hear a command even if its receiver refuses it: both get it from the sender.
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

    def _latched_text(self, publisher: Publisher, shift: int) -> str | None:
        """Return the newest message of a publisher as CDR in base64, its stamps shifted [ns]; None without one."""
        message, saved = publisher.newest, publisher.saved
        if message is None:
            return None
        # A published message never changes, and most of these stay for a whole run, whose every second has a hash.
        if saved is None or saved[0] is not message or saved[1] != shift:
            text = b64encode(self.types.to_cdr(shifted(message, shift))).decode()
            publisher.saved = saved = (message, shift, text)
        return saved[2]

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
    def in_competition(self) -> bool:
        """True in competition mode."""


@dataclass(frozen=True, slots=True)
class Service:
    """Service, and the node that serves it."""

    name: str
    type: ServiceType
    handler: Handler
    node: str


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
