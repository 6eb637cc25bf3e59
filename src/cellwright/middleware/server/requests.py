"""Requests of clients: greeting, message encodings, and execution on the bus."""

import hmac
import json
import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, TypeAlias

from cellwright._package import VERSION
from cellwright.middleware.bus import Bus, Direction, Given, How, Later, Served, TopicInfo, absolute
from cellwright.middleware.interface.table import Pace
from cellwright.middleware.messages import ENCODINGS, Message, ServiceType, definition, md5, message_type, type_of
from cellwright.middleware.server.clients import ClientConnection, Heartbeat, refused_frame
from cellwright.middleware.wire.frames import (
    PROTOCOL,
    QUIET,
    Frame,
    FrameError,
    Kind,
    data_frame,
    read_advance,
    time_frame,
)
from cellwright.util.errors import (
    CellwrightError,
    MessageError,
    RejectedCommandError,
    ServiceFailedError,
    UnknownNameError,
    UsageError,
)


class MessageEncoder:
    """Writes each message once in each form, however many guests it goes to."""

    def __init__(self) -> None:
        self._newest: Message | None = None
        self._written: dict[str, bytes] = {}

    def to_bytes(self, message: Message, encoding: str) -> bytes:
        """A message as bytes; errors as of `messages.Encoding`."""
        if message is not self._newest:
            self._newest, self._written = message, {}
        data = self._written.get(encoding)
        if data is None:
            data = self._written[encoding] = ENCODINGS[encoding].write(message)
        return data


def welcome_frame(cell: Served, *, lockstep: bool) -> Frame:
    """The frame that answers HELLO, as things stand now."""
    timestep = cell.simulation.clock.timestep
    document = {
        "protocol": PROTOCOL,
        "cellwright": VERSION,
        "trial": cell.name,
        "timestep": [timestep.numerator, timestep.denominator],
        "lockstep": lockstep,
        "competition": cell.in_competition,
        "time": cell.simulation.now,
        **describe_interface(cell.bus),
    }
    return Frame(Kind.WELCOME, payload=json.dumps(document).encode())


def describe_interface(bus: Bus) -> dict[str, list[dict[str, Any]]]:
    """Topics and services with their types; the first call takes some time, for checksums are worked out."""
    services = [
        {
            "name": service.name,
            "type": service.type.name,
            "md5": _ros1_form(service.type.name, md5),
            "node": service.node,
        }
        for service in bus.services()
    ]
    return {"topics": [_describe_topic(info) for info in bus.topics()], "services": services}


def _describe_topic(info: TopicInfo) -> dict[str, Any]:
    return {
        "name": info.name,
        "type": info.type,
        "md5": _ros1_form(info.type, md5),
        "definition": _ros1_form(info.type, definition),
        "direction": info.direction.value,
        "rate": info.rate,
        "on_event": info.rate == Pace.ON_EVENT.value,
        "latch": info.latch,
        "publishers": info.publishers,
        "subscribers": info.subscribers,
    }


@cache
def _ros1_form(type_name: str, generate: Callable[[str], str]) -> str:
    """The checksum (`md5`) or `definition` of a type in ROS 1; empty for one that has no form there."""
    try:
        return generate(type_name)
    except UsageError:
        return ""


MOST_SUBSCRIPTIONS = 1024  # of one guest

MAX_PENDING_ADVANCES = 16
"""So many wishes of one guest that time pass may wait at once; a program waits for each before it asks again."""

_LONGEST_NODE = 255

Extra: TypeAlias = Callable[[dict[str, Any]], dict[str, Any] | tuple[dict[str, Any], bytes]]
"""A service of the server itself: takes a JSON object, answers with one, or with one and bytes (DATA).

It refuses with a CellwrightError.
"""

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class AdvanceRequest:
    """A guest's wish that time pass: to `until` [ns], or for one tick; answered with `number`."""

    guest: ClientConnection
    number: int
    until: int
    each_tick: bool


class Requests:
    """Carries out the frames of guests, in the order in which they are handed in."""

    def __init__(self, cell: Served, *, lockstep: bool) -> None:
        self._cell = cell
        self._lockstep = lockstep
        self._translation = MessageEncoder()
        topics = cell.bus.topics()
        self._heard = {info.name: message_type(info.type) for info in topics if info.direction is Direction.IN}
        self._services = {service.name: service.type for service in cell.bus.services()}
        self.asked: deque[AdvanceRequest] = deque()  # wishes that time pass, in the order in which they came
        self.extras: dict[str, tuple[Extra, bool]] = {}
        """Services of the server itself, by name, and whether they are noted as commands are. No bridge offers them."""
        self.guarded: dict[str, str] = {}
        """Those of them that answer only who has shown the key, and what all others are told."""
        self.key = ""  # the key; empty: there is none
        welcome_frame(cell, lockstep=lockstep)  # works out all checksums now, while nobody waits

    def carry_out(self, guest: ClientConnection, frame: Frame) -> None:
        """Do what a frame asks for, and answer; a FrameError if it is nothing that a guest may say."""
        if not guest.node:
            self._greet(guest, frame)
            return
        try:
            self._act(guest, frame)
        except CellwrightError as error:
            guest.say(refused_frame(frame.number, error))
        except FrameError:
            raise
        except Exception as error:  # a defect of ours that a guest came upon: it must not end the run of all others
            log.exception("%s %s of %s", frame.kind.name, frame.name, guest.name)
            failed = ServiceFailedError(f"the cell failed: {type(error).__name__}: {error}")
            guest.say(refused_frame(frame.number, failed))

    def forget(self, guest: ClientConnection) -> None:
        """Forget what a guest has wished for that is gone."""
        self.asked = deque(each for each in self.asked if each.guest is not guest)

    def answer(self, asked: AdvanceRequest) -> None:
        """Give time back to the guest that asked for it to pass."""
        asked.guest.has_news = False
        asked.guest.say(time_frame(asked.number, self._cell.simulation.now))

    def _act(self, guest: ClientConnection, frame: Frame) -> None:
        if frame.node and not _is_name(frame.node):
            raise UsageError(f"a node's name is like '/robot', not {frame.node!r:.40}")
        match frame.kind:
            case Kind.SUBSCRIBE:
                self._subscribe(guest, frame)
            case Kind.UNSUBSCRIBE:
                guest.subscriptions.pop(frame.number, _nothing)()
            case Kind.PUBLISH:
                self._publish(guest, frame)
            case Kind.CALL:
                self._call(guest, frame)
            case Kind.ADVANCE:
                self._advance(guest, frame)
            case Kind.PONG:
                now = time.monotonic()
                guest.heartbeat = guest.heartbeat or Heartbeat(now)
                guest.heartbeat.pong(frame.number, now)
            case _:
                again = " again" if frame.kind is Kind.HELLO else ""
                raise FrameError(f"{frame.kind.name} is nothing that a guest may say{again}")

    def _greet(self, guest: ClientConnection, frame: Frame) -> None:
        if frame.kind is not Kind.HELLO:
            raise FrameError(f"the first word must be HELLO, not {frame.kind.name}")
        said = frame.json()
        protocol, node, encoding = (said.get(key) for key in ("protocol", "node", "encoding"))
        if protocol != PROTOCOL:
            raise FrameError(f"this cell speaks protocol {PROTOCOL}, not {protocol!r:.20}")
        if not isinstance(node, str) or not _is_name(node):
            raise FrameError(f"a node's name is like '/robot', not {node!r:.40}")
        if not isinstance(encoding, str) or encoding not in ENCODINGS:
            raise FrameError(f"messages can be had as {' or '.join(ENCODINGS)}, not {encoding!r:.20}")
        guest.greet(node, encoding)
        guest.has_key = self._is_key(said.get("key"))
        guest.say(welcome_frame(self._cell, lockstep=self._lockstep))

    def _subscribe(self, guest: ClientConnection, frame: Frame) -> None:
        if frame.number in guest.subscriptions:
            raise UsageError(f"the number {frame.number} is in use for another subscription")
        if len(guest.subscriptions) >= MOST_SUBSCRIPTIONS:
            raise UsageError(f"no more than {MOST_SUBSCRIPTIONS} subscriptions are taken of one guest")
        if frame.type not in ("", QUIET):
            raise UsageError(f"a subscription is {QUIET} or says nothing, not {frame.type:.20}")
        bus = self._cell.bus
        cancel = _nothing
        try:
            bus.topic(frame.name)
        except UnknownNameError:
            absolute(frame.name)  # it is waited for, as in a process; but names from outside must not fill the bus
        else:
            deliver = partial(self._deliver, guest, frame.number, frame.type == QUIET)
            cancel = bus.subscribe(frame.name, deliver, node=guest.node, origin=frame.node or None).cancel
        guest.subscriptions[frame.number] = cancel
        guest.say(Frame(Kind.DONE, frame.number))

    def _deliver(self, guest: ClientConnection, number: int, is_quiet: bool, message: Message) -> None:  # noqa: FBT001
        try:
            data = self._translation.to_bytes(message, guest.encoding)
            guest.tell(number, data, is_quiet=is_quiet)
        except (CellwrightError, FrameError) as error:  # it has no such form, or is too long; the step goes on
            guest.untold[str(error)] += 1

    def _publish(self, guest: ClientConnection, frame: Frame) -> None:
        node = frame.node or guest.node
        message_class = self._heard.get(frame.name)
        message: Any = None  # the bus refuses a topic that it does not hear before it looks at the message
        if message_class is not None:
            message = self._read(guest, frame, message_class, type_of(message_class))
        self._cell.bus.publish(frame.name, message, node=node, is_decoded=True)
        if frame.number:
            guest.say(Frame(Kind.DONE, frame.number))

    def _call(self, guest: ClientConnection, frame: Frame) -> None:
        if frame.name in self.extras:
            extra, acts = self.extras[frame.name]
            if frame.name in self.guarded and not guest.has_key:
                raise RejectedCommandError(self.guarded[frame.name])
            asked = frame.json()
            if acts:
                self._cell.bus.note(Given(How.EXTRA, frame.name, asked, frame.node or guest.node))
            answer = extra(asked)
            if isinstance(answer, dict):
                said = Frame(Kind.ANSWER, frame.number, payload=json.dumps(answer).encode())
            else:
                said = data_frame(frame.number, *answer)
            try:
                guest.say(said)
            except FrameError as error:
                raise UsageError(f"{frame.name}: {error}") from None
            return
        self._cell.simulation.settle_inbox()
        service: ServiceType | None = self._services.get(frame.name)
        request: Any = None if service is None else self._read(guest, frame, service.request, service.name)
        response = self._cell.bus.call(frame.name, request, node=frame.node or guest.node, is_decoded=True)
        if isinstance(response, Later):
            if self._lockstep and response.response is None:  # who waits without letting time pass waits for ever
                guest.say(Frame(Kind.DONE, frame.number))
            response.then(partial(self._answer, guest, frame.number))
        else:
            self._answer(guest, frame.number, response)

    def _answer(self, guest: ClientConnection, number: int, response: Message) -> None:
        """Pass on an answer, which may have taken its time; whoever asked may have left."""
        if not guest.is_gone:
            guest.say(Frame(Kind.ANSWER, number, payload=self._translation.to_bytes(response, guest.encoding)))

    def _is_key(self, shown: Any) -> bool:
        """Whether this is the key; it takes as long to see that it is not, however much of it is right."""
        if not isinstance(shown, str) or not self.key:
            return False
        return hmac.compare_digest(shown.encode(errors="replace"), self.key.encode())

    def _advance(self, guest: ClientConnection, frame: Frame) -> None:
        until, each_tick = read_advance(frame)
        if not self._lockstep:
            raise UsageError("time passes by itself here; only in lockstep can it be asked for")
        if sum(each.guest is guest for each in self.asked) >= MAX_PENDING_ADVANCES:
            raise UsageError(f"{MAX_PENDING_ADVANCES} wishes of this guest that time pass wait already")
        self.asked.append(AdvanceRequest(guest, frame.number, until, each_tick))

    def _read(self, guest: ClientConnection, frame: Frame, message_class: type[Message], type_name: str) -> Message:
        """The message in a frame; what is none is counted and reported, as the bus does with what it refuses."""
        try:
            if frame.type not in ("", type_name):
                raise MessageError(f"it takes {type_name}, not {frame.type:.80}")
            return ENCODINGS[guest.encoding].read(frame.payload, message_class)
        except MessageError as error:
            self._cell.bus.refusals.refuse(f"{frame.name} from {frame.node or guest.node}", str(error))
            raise


def _is_name(node: str) -> bool:
    """Whether a node may be called so: its name is printed where people read, and must not break their lines."""
    return node.startswith("/") and 1 < len(node) <= _LONGEST_NODE and node.isprintable()


def _nothing() -> None:
    pass
