"""Requests of clients: greeting, message encodings, and execution on the bus."""

import hmac
import json
import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

from cellwright._package import VERSION
from cellwright.middleware.bus import (
    Bus,
    Direction,
    ExternalInput,
    InputKind,
    Node,
    PendingResponse,
    TopicInfo,
    absolute,
)
from cellwright.middleware.interface.table import Timing
from cellwright.middleware.messages import Message, ServiceType, TypeSet, type_of
from cellwright.middleware.server.clients import ClientConnection, Heartbeat, refused_frame
from cellwright.middleware.server.streams import AnswerStream, Streams
from cellwright.middleware.wire.frames import (
    PROTOCOL,
    QUIET,
    Frame,
    FrameError,
    FrameKind,
    data_frame,
    read_advance,
    time_frame,
)
from cellwright.middleware.wire.quiet_clock import TIME
from cellwright.util.errors import (
    CellwrightError,
    MessageError,
    RejectedCommandError,
    ServiceFailedError,
    UnknownNameError,
    UsageError,
)

MAX_SUBSCRIPTIONS = 1024  # of one client
MAX_PENDING_ADVANCES = 16
"""Largest number of pending ADVANCE requests of one client; a program waits for each before the next one."""
_MAX_NODE_LENGTH = 255

Reply: TypeAlias = dict[str, Any] | tuple[dict[str, Any], bytes]

Extra: TypeAlias = Callable[[dict[str, Any]], Reply | PendingResponse | AnswerStream]
"""Service of the server itself: takes a JSON object, and returns one, or one and bytes (DATA).

It may also answer later, or again and again. It refuses with a CellwrightError.
"""

log = logging.getLogger(__name__)


class MessageEncoder:
    """Encoder that writes each message once in each encoding, for any number of clients."""

    def __init__(self, types: TypeSet) -> None:
        self._encodings = types.encodings
        self._newest: Message | None = None
        self._written: dict[str, bytes] = {}

    def to_bytes(self, message: Message, encoding: str) -> bytes:
        """Return a message as bytes; errors as of `messages.Encoding`."""
        if message is not self._newest:
            self._newest, self._written = message, {}
        data = self._written.get(encoding)
        if data is None:
            data = self._written[encoding] = self._encodings[encoding].write(message)
        return data


def welcome_frame(cell: Node, *, lockstep: bool) -> Frame:
    """Return the frame that answers HELLO in the current state."""
    timestep = cell.simulation.clock.timestep
    document = {
        "protocol": PROTOCOL,
        "cellwright": VERSION,
        "trial": cell.name,
        "timestep": [timestep.numerator, timestep.denominator],
        "lockstep": lockstep,
        "competition": cell.in_competition,
        "time": cell.simulation.clock.message_time(),
        **describe_interface(cell.bus),
    }
    return Frame(FrameKind.WELCOME, payload=json.dumps(document).encode())


def describe_interface(bus: Bus) -> dict[str, list[dict[str, Any]]]:
    """Return topics, services and actions with their types; the first call takes time, as it computes checksums."""
    services = [
        {
            "name": service.name,
            "type": service.type.name,
            "md5": _ros1_form(service.type.name, bus.types.md5),
            "node": service.node,
        }
        for service in bus.services()
    ]
    actions = [{"name": name, "type": type_name} for name, type_name in bus.actions.items()]
    return {
        "topics": [_describe_topic(info, bus.types) for info in bus.topics()],
        "services": services,
        "actions": actions,
    }


def _describe_topic(info: TopicInfo, types: TypeSet) -> dict[str, Any]:
    return {
        "name": info.name,
        "type": info.type,
        "md5": _ros1_form(info.type, types.md5),
        "definition": _ros1_form(info.type, types.definition),
        "direction": info.direction.value,
        "rate": info.rate,
        "on_event": info.rate == Timing.ON_EVENT.value,
        "latch": info.latch,
        "qos": {
            "reliable": info.qos.is_reliable,
            "transient_local": info.qos.is_transient_local,
            "depth": info.qos.depth,
        },
        "publishers": info.publishers,
        "subscribers": info.subscribers,
    }


def _ros1_form(type_name: str, generate: Callable[[str], str]) -> str:
    """Return the checksum (`md5`) or `definition` of a type in ROS 1; "" for a type without a ROS 1 form."""
    try:
        return generate(type_name)
    except UsageError:
        return ""


@dataclass(frozen=True, slots=True)
class AdvanceRequest:
    """Request of a client to advance message time to `until` [ns], or by one tick; answered with `number`."""

    client: ClientConnection
    number: int
    until: int
    each_tick: bool


class Requests:
    """Executor of clients' frames, in the order of `carry_out`."""

    def __init__(self, cell: Node, *, lockstep: bool) -> None:
        self._cell = cell
        self._lockstep = lockstep
        self._types = cell.bus.types
        self._translation = MessageEncoder(self._types)
        topics = cell.bus.topics()
        self._inputs = {info.name: self._types.message(info.type) for info in topics if info.direction is Direction.IN}
        self._services = {service.name: service.type for service in cell.bus.services()}
        self.pending: deque[AdvanceRequest] = deque()  # pending ADVANCE requests, in the order of arrival
        clock = cell.simulation.clock
        self.extras: dict[str, tuple[Extra, bool]] = {TIME: (lambda _request: {"time": clock.message_time()}, False)}
        """Services of the server itself by name; true if they are noted as commands are. No bridge offers them."""
        self.guarded: dict[str, str] = {}
        """Those of them that require the key, with the reason that all other clients get."""
        self.key = ""  # empty: there is none
        self.streams = Streams()
        """Answers to come without a further request."""
        # Compute all checksums now, while no client waits.
        welcome_frame(cell, lockstep=lockstep)

    def carry_out(self, client: ClientConnection, frame: Frame) -> None:
        """Carry out a frame, and answer; a FrameError if a client must not send it."""
        if not client.node:
            self._greet(client, frame)
            return
        refusals = self._cell.bus.refusals
        refusals.newest_report = None
        try:
            self._act(client, frame)
        except CellwrightError as error:
            client.send(refused_frame(frame.number, error, refusals.newest_report))
        except FrameError:
            raise
        except Exception as error:  # a defect of Cellwright that one client found must not end the run of all others
            log.exception("%s %s of %s", frame.kind.name, frame.name, client.name)
            failed = ServiceFailedError(f"the cell failed: {type(error).__name__}: {error}")
            client.send(refused_frame(frame.number, failed))

    def forget(self, client: ClientConnection) -> None:
        """Forget the requests of a client that is gone."""
        self.streams.end(client)
        self.pending = deque(each for each in self.pending if each.client is not client)

    def answer(self, request: AdvanceRequest) -> None:
        """Answer an ADVANCE request with the current time."""
        request.client.has_news = False
        request.client.send(time_frame(request.number, self._cell.simulation.clock.message_time()))

    def _act(self, client: ClientConnection, frame: Frame) -> None:
        if frame.node and not _is_name(frame.node):
            raise UsageError(f"a node name must look like '/robot', not {frame.node!r:.40}")
        match frame.kind:
            case FrameKind.SUBSCRIBE:
                self._subscribe(client, frame)
            case FrameKind.UNSUBSCRIBE:
                client.subscriptions.pop(frame.number, _nothing)()
                self.streams.end(client, frame.number)
            case FrameKind.PUBLISH:
                self._publish(client, frame)
            case FrameKind.CALL:
                self._call(client, frame)
            case FrameKind.ADVANCE:
                self._advance(client, frame)
            case FrameKind.PONG:
                now = time.monotonic()
                client.heartbeat = client.heartbeat or Heartbeat(now)
                client.heartbeat.pong(frame.number, now)
            case _:
                again = " again" if frame.kind is FrameKind.HELLO else ""
                raise FrameError(f"a client cannot send {frame.kind.name}{again}")

    def _greet(self, client: ClientConnection, frame: Frame) -> None:
        if frame.kind is not FrameKind.HELLO:
            raise FrameError(f"the first frame must be HELLO, not {frame.kind.name}")
        greeting = frame.json()
        protocol, node, encoding = (greeting.get(key) for key in ("protocol", "node", "encoding"))
        if protocol != PROTOCOL:
            raise FrameError(f"the server uses protocol {PROTOCOL}, not {protocol!r:.20}")
        if not isinstance(node, str) or not _is_name(node):
            raise FrameError(f"a node name must look like '/robot', not {node!r:.40}")
        if not isinstance(encoding, str) or encoding not in self._types.encodings:
            raise FrameError(f"encoding must be {' or '.join(self._types.encodings)}, not {encoding!r:.20}")
        client.greet(node, encoding)
        client.has_key = self._is_key(greeting.get("key"))
        client.wants_notices = greeting.get("notices") is True
        client.send(welcome_frame(self._cell, lockstep=self._lockstep))

    def _subscribe(self, client: ClientConnection, frame: Frame) -> None:
        if frame.number in client.subscriptions:
            raise UsageError(f"number {frame.number} is in use for another subscription")
        if len(client.subscriptions) >= MAX_SUBSCRIPTIONS:
            raise UsageError(f"a client may have at most {MAX_SUBSCRIPTIONS} subscriptions")
        if frame.type not in ("", QUIET):
            raise UsageError(f"the type of a subscription must be {QUIET} or empty, not {frame.type:.20}")
        bus = self._cell.bus
        cancel = _nothing
        try:
            bus.topic(frame.name)
        except UnknownNameError:
            absolute(frame.name)  # it may come later, as in a process; but names from outside must not fill the bus
        else:
            deliver = partial(self._deliver, client, frame.number, frame.type == QUIET)
            cancel = bus.subscribe(frame.name, deliver, node=client.node, origin=frame.node or None).cancel
        client.subscriptions[frame.number] = cancel
        client.send(Frame(FrameKind.DONE, frame.number))

    def _deliver(self, client: ClientConnection, number: int, is_quiet: bool, message: Message) -> None:  # noqa: FBT001
        try:
            data = self._translation.to_bytes(message, client.encoding)
            client.send_message(number, data, is_quiet=is_quiet)
        except (CellwrightError, FrameError) as error:  # it has no such encoding, or is too long; the step goes on
            client.missed[str(error)] += 1

    def _publish(self, client: ClientConnection, frame: Frame) -> None:
        node = frame.node or client.node
        message_class = self._inputs.get(frame.name)
        # The bus refuses an unknown topic before it reads the message.
        message: Any = None
        if message_class is not None:
            message = self._read(client, frame, message_class, type_of(message_class))
        self._cell.bus.publish(frame.name, message, node=node, is_decoded=True)
        if frame.number:
            client.send(Frame(FrameKind.DONE, frame.number))

    def _call(self, client: ClientConnection, frame: Frame) -> None:
        if frame.name in self.extras:
            extra, acts = self.extras[frame.name]
            if frame.name in self.guarded and not client.has_key:
                raise RejectedCommandError(self.guarded[frame.name])
            if self.streams.renew(client, frame.number):
                return
            arguments = frame.json()
            if acts:
                self._cell.bus.note(ExternalInput(InputKind.EXTRA, frame.name, arguments, frame.node or client.node))
            answer = extra(arguments)
            if isinstance(answer, PendingResponse):
                answer.then(partial(self._reply, client, frame))
            elif isinstance(answer, dict | tuple):
                self._reply(client, frame, answer)
            else:
                self.streams.begin(client, frame.number, answer)
            return
        self._cell.simulation.settle_inbox()
        service: ServiceType | None = self._services.get(frame.name)
        request: Any = None if service is None else self._read(client, frame, service.request, service.name)
        response = self._cell.bus.call(frame.name, request, node=frame.node or client.node, is_decoded=True)
        if isinstance(response, PendingResponse):
            if (
                self._lockstep and response.response is None
            ):  # a client that does not advance time meanwhile would wait forever
                client.send(Frame(FrameKind.DONE, frame.number))
            response.then(partial(self._answer, client, frame.number))
        else:
            self._answer(client, frame.number, response)

    def _reply(self, client: ClientConnection, frame: Frame, answer: Any) -> None:
        """Send the answer of a service of the server, which may be a late one; the client may have left."""
        if client.is_gone:
            return
        if isinstance(answer, dict):
            reply = Frame(FrameKind.ANSWER, frame.number, payload=json.dumps(answer).encode())
        else:
            reply = data_frame(frame.number, *answer)
        try:
            client.send(reply)
        except FrameError as error:
            raise UsageError(f"{frame.name}: {error}") from None

    def _answer(self, client: ClientConnection, number: int, response: Message) -> None:
        """Send an answer, which may be a late one; the client may have left."""
        if not client.is_gone:
            client.send(Frame(FrameKind.ANSWER, number, payload=self._translation.to_bytes(response, client.encoding)))

    def _is_key(self, shown: Any) -> bool:
        """True if this is the key; the comparison takes the same time for every wrong key."""
        if not isinstance(shown, str) or not self.key:
            return False
        return hmac.compare_digest(shown.encode(errors="replace"), self.key.encode())

    def _advance(self, client: ClientConnection, frame: Frame) -> None:
        until, each_tick = read_advance(frame)
        if not self._lockstep:
            raise UsageError("ADVANCE requires lockstep; time advances without requests here")
        if sum(each.client is client for each in self.pending) >= MAX_PENDING_ADVANCES:
            raise UsageError(f"a client may have at most {MAX_PENDING_ADVANCES} pending ADVANCE requests")
        self.pending.append(AdvanceRequest(client, frame.number, until, each_tick))

    def _read(self, client: ClientConnection, frame: Frame, message_class: type[Message], type_name: str) -> Message:
        """Return the message in a frame; invalid ones are counted and reported like refused input of the bus."""
        try:
            if frame.type not in ("", type_name):
                raise MessageError(f"it takes {type_name}, not {frame.type:.80}")
            return self._types.encodings[client.encoding].read(frame.payload, message_class)
        except MessageError as error:
            self._cell.bus.refusals.refuse(f"{frame.name} from {frame.node or client.node}", str(error))
            raise


def _is_name(node: str) -> bool:
    """True if a node may have this name: it appears in printed lines, and must not break them."""
    return node.startswith("/") and 1 < len(node) <= _MAX_NODE_LENGTH and node.isprintable()


def _nothing() -> None:
    pass
