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
from typing import Any, Callable

import rospy
from rospy.impl.registration import get_service_manager
from rospy.impl.tcpros_base import get_tcpros_server_address

from cellwright.middleware.ros1.bridge.message_bytes import STEP_TYPE, DeliveryCounter, read_step_request, step_response
from cellwright.middleware.ros1.bridge.tcpros import ANY, Header, handshake_bytes
from cellwright.middleware.wire.command_queue import Step, StepQueue, refusal_line
from cellwright.middleware.wire.connection import BufferedConnection, LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, nothing
from cellwright.middleware.wire.frames import MAX_CLIENT_FRAME_BYTES, Frame, FrameError, FrameKind

NO_ANSWER = "ServiceFailedError"  # error of a service without an answer; it is reported without a reason
_LENGTH = struct.Struct("<I")
_HEAD = struct.Struct("<BI")

Handler = Callable[["Caller", bytes], None]
"""Takes the caller to respond to, and the request; called by the loop's thread."""

STEP_SERVICE = "/cellwright/step"


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


def cell_service(
    loop: EventLoop, link: LinkClient, service: dict[str, Any], log: Callable[[str], None] = nothing
) -> RosService:
    """Return a service that WELCOME describes, which forwards everything to the cell; `log` takes its refusals."""
    name, type_name = service["name"], service["type"]

    def handle(caller: Caller, request: bytes) -> None:
        def answered(frame: Frame) -> None:
            # In lockstep: it takes time, which other callers may advance.
            if frame.kind is FrameKind.DONE:
                link.ask_again(frame.number, answered)
            elif frame.kind is FrameKind.ANSWER:
                caller.respond(True, frame.payload)
            else:
                if line := refusal_line(frame, name, caller.node):
                    log(line)
                caller.respond(False, b"" if frame.name == NO_ANSWER else one_line(frame.text()))

        try:
            link.request(FrameKind.CALL, answered, name=name, type=type_name, node=caller.node, payload=request)
        except FrameError as error:
            caller.respond(False, one_line(str(error)))

    return RosService(loop, name, type_name, service["md5"], handle)


def one_line(text: str) -> bytes:
    """Return a reason as one line of bytes, as ROS carries it."""
    return " ".join(text.split()).encode()


class StepService:
    """Service that lets time pass, after the caller's messages; `sent` counts those to callers."""

    def __init__(self, steps: StepQueue, sent: DeliveryCounter) -> None:
        self._steps = steps
        self._sent = sent

    def handle(self, caller: Caller, request: bytes) -> None:
        """Take a request."""
        try:
            duration, published = read_step_request(request)
        except (struct.error, ValueError) as error:
            caller.respond(False, f"invalid request of {STEP_TYPE}: {error}".encode())
            return

        def finished(failure: str, now: int) -> None:
            caller.respond(True, step_response(failure, now, self._sent.of(caller.node)))

        self._steps.add(Step(caller.node, duration, published, finished, lambda: caller.is_gone))
