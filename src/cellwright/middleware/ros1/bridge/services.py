"""Services of the bridge: calls forwarded to the cell, and lockstep time as a service.

A service without an answer fails the call, like a C++ service that returns false. A refused request also fails it, with
the reason.

A caller may give the number of messages that it has published on each topic. Then the step waits for them, since they
use other connections, which it might overtake. The response has the number of messages sent to the caller on each of
its topics, so that the caller can wait for them: the same program gets the same result on any host.
"""

from __future__ import annotations

import socket
import struct
import time
from collections import deque
from dataclasses import dataclass
from typing import Any, Callable

import rospy
from rospy.impl.registration import get_service_manager
from rospy.impl.tcpros_base import get_tcpros_server_address

from cellwright.middleware.ros1.bridge.connection import BufferedConnection, LinkClient
from cellwright.middleware.ros1.bridge.loop import EventLoop
from cellwright.middleware.ros1.bridge.message_bytes import STEP_TYPE, DeliveryCounter, read_step_request, step_response
from cellwright.middleware.ros1.bridge.tcpros import ANY, Header, handshake_bytes
from cellwright.middleware.ros1.bridge.topics import CommandTopic
from cellwright.middleware.wire.frames import MAX_CLIENT_FRAME_BYTES, Frame, FrameError, FrameKind, advance, read_time

NO_ANSWER = "ServiceFailedError"  # error of a service without an answer; it is reported without a reason
_LENGTH = struct.Struct("<I")
_HEAD = struct.Struct("<BI")

Handler = Callable[["Caller", bytes], None]
"""Takes the caller to respond to, and the request; called by the loop's thread."""


class RosService:
    """One service, as rospy's service manager and the TCPROS server know it."""

    def __init__(self, loop: EventLoop, name: str, type_name: str, md5: str, handler: Handler) -> None:
        self._loop = loop
        self.resolved_name = name
        self.type = type_name
        self.md5sum = md5
        self.handler = handler
        host, port = get_tcpros_server_address()
        self.uri = f"rosrpc://{host}:{port}"

    def register(self) -> None:
        """Register the service with the master."""
        get_service_manager().register(self.resolved_name, self)

    def take(self, connection: socket.socket, header: Header) -> str | None:
        """Accept a caller's connection; else return the reason."""
        if header["md5sum"] not in (ANY, self.md5sum):
            return f"{self.resolved_name} has md5sum {self.md5sum}, not {header['md5sum']}"
        Caller(self, self._loop, connection, header)
        return None


class Caller:
    """Connection of a caller: for one request, or for consecutive ones if it is persistent."""

    def __init__(self, service: RosService, loop: EventLoop, connection: socket.socket, header: Header) -> None:
        self._service = service
        self.node = header["callerid"]
        self._is_persistent = header.get("persistent", "").lower() in ("1", "true")
        self._data = bytearray()
        self._is_busy = False
        self._connection = BufferedConnection(loop, connection, self._read)
        self._connection.send(
            handshake_bytes(
                {
                    "service": service.resolved_name,
                    "type": service.type,
                    "request_type": f"{service.type}Request",
                    "response_type": f"{service.type}Response",
                    "md5sum": service.md5sum,
                    "callerid": rospy.get_name(),
                }
            )
        )
        if header.get("probe") == "1":
            self._is_busy = True
            self._connection.close_when_empty()

    @property
    def is_gone(self) -> bool:
        """True if the caller has hung up."""
        return self._connection.is_closed

    def respond(self, succeeded: bool, response: bytes) -> None:  # noqa: FBT001
        """Answer the request with a response, or with an error."""
        self._connection.send(_HEAD.pack(succeeded, len(response)) + response)
        if not self._is_persistent:
            self._connection.close_when_empty()
            return
        self._is_busy = False
        self._handle()

    def _read(self, data: bytes) -> None:
        self._data += data
        if len(self._data) > MAX_CLIENT_FRAME_BYTES + _LENGTH.size:
            self._connection.close()
        self._handle()

    def _handle(self) -> None:
        """Handle the next request, if it has arrived and none is pending."""
        data = self._data
        if self._is_busy or self._connection.is_closed or len(data) < _LENGTH.size:
            return
        (length,) = _LENGTH.unpack_from(data)
        if length > MAX_CLIENT_FRAME_BYTES:
            self._connection.close()
            return
        end = _LENGTH.size + length
        if len(data) < end:
            return
        request = bytes(data[_LENGTH.size : end])
        del data[:end]
        self._is_busy = True
        self._service.handler(self, request)


def cell_service(loop: EventLoop, link: LinkClient, service: dict[str, Any]) -> RosService:
    """Return a service that WELCOME describes, which forwards everything to the cell."""
    name, type_name = service["name"], service["type"]

    def handle(caller: Caller, request: bytes) -> None:
        def answered(frame: Frame) -> None:
            if frame.kind is FrameKind.DONE:  # in lockstep: it takes time, which other callers may advance
                link.ask_again(frame.number, answered)
            elif frame.kind is FrameKind.ANSWER:
                caller.respond(True, frame.payload)
            else:
                caller.respond(False, b"" if frame.name == NO_ANSWER else one_line(frame.text()))

        try:
            link.request(FrameKind.CALL, answered, name=name, type=type_name, node=caller.node, payload=request)
        except FrameError as error:
            caller.respond(False, one_line(str(error)))

    return RosService(loop, name, type_name, service["md5"], handle)


def one_line(text: str) -> bytes:
    """Return a reason as one line of bytes, as ROS carries it."""
    return " ".join(text.split()).encode()


STEP_SERVICE = "/cellwright/step"
MESSAGE_TIMEOUT = 5.0  # time for published messages to arrive [s]

FRESH = 0.05
"""Wall time [s] for which the cell's last answer counts as the current time; others may advance it too, so it is
requested again then. Callers that step at the same moment wait for the same time."""

_NANOSECONDS = 1_000_000_000


@dataclass
class PendingStep:
    """Requested step of time."""

    caller: Caller
    duration: int  # [ns]
    published: dict[str, int]  # number of messages that the caller has published, by topic
    end: float = 0.0  # wall time [s] at which the step fails for lack of messages
    until: int | None = None  # simulation time at its end [ns]; None before it has begun


class StepService:
    """Service that carries out steps, one after the other; `topics` are those that the cell receives."""

    def __init__(
        self, loop: EventLoop, link: LinkClient, topics: dict[str, CommandTopic], sent: DeliveryCounter
    ) -> None:
        self._loop = loop
        self._link = link
        self._topics = topics
        self._sent = sent
        self._steps: deque[PendingStep] = deque()
        self._is_advancing = False
        self._now = 0
        self._known = -FRESH

    def handle(self, caller: Caller, request: bytes) -> None:
        """Take a request."""
        try:
            duration, published = read_step_request(request)
        except (struct.error, ValueError) as error:
            caller.respond(False, f"invalid request of {STEP_TYPE}: {error}".encode())
            return
        published = {name: count for name, count in published.items() if count}
        unknown = [name for name in published if name not in self._topics]
        if duration < 0:
            caller.respond(
                True, step_response(f"duration must not be negative (got {duration / _NANOSECONDS:g} s)", 0, [])
            )
        elif unknown:
            caller.respond(
                True,
                step_response(f"the cell does not subscribe to {unknown[0]} (known: {', '.join(self._topics)})", 0, []),
            )
        else:
            self._steps.append(PendingStep(caller, duration, published))
            if len(self._steps) == 1:
                self._begin()

    def look(self) -> None:
        """Check whether the messages that the step waits for have come. Called by the loop's thread."""
        if not self._steps or self._is_advancing:
            return
        step = self._steps[0]
        missing = self._missing(step)
        if missing is None:
            self._is_advancing = True
            if time.monotonic() - self._known < FRESH:
                step.until = self._now + step.duration
            self._advance(step.until or 0)
        elif time.monotonic() > step.end:
            self._finish(missing)

    def _begin(self) -> None:
        self._steps[0].end = time.monotonic() + MESSAGE_TIMEOUT
        self.look()
        if self._steps and not self._is_advancing:
            self._loop.later(MESSAGE_TIMEOUT + 0.001, self.look)

    def _missing(self, step: PendingStep) -> str | None:
        for name, count in step.published.items():
            arrived = self._topics[name].handed_over(step.caller.node)
            if arrived < count:
                node = step.caller.node
                return f"only {arrived} of {count} messages on {name} from {node} arrived within {MESSAGE_TIMEOUT:g} s"
        return None

    def _advance(self, until: int) -> None:
        self._link.request(FrameKind.ADVANCE, self._advanced, payload=advance(0, until, each_tick=False).payload)

    def _advanced(self, frame: Frame) -> None:
        step = self._steps[0]
        try:
            if frame.kind is not FrameKind.TIME:
                raise FrameError(frame.text())
            self._now = now = read_time(frame)
            self._known = time.monotonic()
        except FrameError as error:
            self._finish(str(error))
            return
        if step.until is None:
            step.until = now + step.duration
        if now < step.until and not step.caller.is_gone:
            self._advance(step.until)
        else:
            self._finish("", now)

    def _finish(self, message: str, now: int = 0) -> None:
        step = self._steps.popleft()
        self._is_advancing = False
        step.caller.respond(True, step_response(message, now, self._sent.of(step.caller.node)))
        if self._steps:
            self._begin()
