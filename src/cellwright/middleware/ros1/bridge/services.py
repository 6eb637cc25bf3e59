"""Services of the cell: a request goes over the link under the caller's name, and its answer back.

A service that takes a request and gives no answer fails the call as a C++ service does that returns false. A request
that is refused fails it too, with the reason.
"""

from __future__ import annotations

import socket
import struct
from typing import Any, Callable

import rospy
from rospy.impl.registration import get_service_manager
from rospy.impl.tcpros_base import get_tcpros_server_address

from cellwright.middleware.ros1.bridge.handshakes import handshake
from cellwright.middleware.ros1.bridge.link_client import LinkClient
from cellwright.middleware.ros1.bridge.loop import Loop
from cellwright.middleware.ros1.bridge.outlet import Outlet
from cellwright.middleware.ros1.bridge.raw_types import ANY
from cellwright.middleware.ros1.bridge.received import received
from cellwright.middleware.ros1.bridge.tcpros import Header
from cellwright.middleware.wire.frames import LONGEST_SAID, Frame, FrameError, Kind

NO_ANSWER = "ServiceFailedError"
"""The error of a service that gives no answer, which is told without a reason."""

_PIECE = 1 << 16
_LENGTH = struct.Struct("<I")
_HEAD = struct.Struct("<BI")

Handler = Callable[["Caller", bytes], None]
"""Takes who calls, to be responded to, and the request; called by the loop's thread."""


class Service:
    """One service, as rospy's service manager and the TCPROS server know it.

    Args:
        loop: what serves its connections.
        name: absolute name.
        type_name: type of the service.
        md5: its checksum.
        handler: answers requests.
    """

    def __init__(self, loop: Loop, name: str, type_name: str, md5: str, handler: Handler) -> None:
        self._loop = loop
        self.resolved_name = name
        self.type = type_name
        self.md5sum = md5
        self.handler = handler
        host, port = get_tcpros_server_address()
        self.uri = f"rosrpc://{host}:{port}"

    def register(self) -> None:
        """Announce the service to the master."""
        get_service_manager().register(self.resolved_name, self)

    def take(self, connection: socket.socket, header: Header) -> str | None:
        """Take on a caller's connection, or say why not."""
        if header["md5sum"] not in (ANY, self.md5sum):
            return f"{self.resolved_name} has md5sum {self.md5sum}, not {header['md5sum']}"
        Caller(self, self._loop, connection, header)
        return None


class Caller:
    """A connection of somebody who calls: one request, or one after the other on a persistent one.

    Args:
        service: what is called.
        loop: what serves the connection.
        connection: a socket that does not block.
        header: what the caller's handshake said.
    """

    def __init__(self, service: Service, loop: Loop, connection: socket.socket, header: Header) -> None:
        self._service = service
        self._connection = connection
        self.node = header["callerid"]
        self._is_persistent = header.get("persistent", "").lower() in ("1", "true")
        self._data = bytearray()
        self._is_busy = False
        self._outlet = Outlet(loop, connection, self._read)
        self._outlet.send(
            handshake(
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
            self._outlet.close_when_empty()

    @property
    def is_gone(self) -> bool:
        """Whether nobody waits for a response any more."""
        return self._outlet.is_closed

    def respond(self, succeeded: bool, response: bytes) -> None:  # noqa: FBT001
        """Answer the request with a response, or with the reason why there is none."""
        self._outlet.send(_HEAD.pack(succeeded, len(response)) + response)
        if not self._is_persistent:
            self._outlet.close_when_empty()
            return
        self._is_busy = False
        self._handle()

    def _read(self) -> None:
        data = received(self._connection, _PIECE)
        if data is None:
            return
        self._data += data
        if not data or len(self._data) > LONGEST_SAID + _LENGTH.size:
            self._outlet.close()
            return
        self._handle()

    def _handle(self) -> None:
        """Hand the next request over, if it is there and none is being answered."""
        data = self._data
        if self._is_busy or self._outlet.is_closed or len(data) < _LENGTH.size:
            return
        (length,) = _LENGTH.unpack_from(data)
        if length > LONGEST_SAID:
            self._outlet.close()
            return
        end = _LENGTH.size + length
        if len(data) < end:
            return
        request = bytes(data[_LENGTH.size : end])
        del data[:end]
        self._is_busy = True
        self._service.handler(self, request)


def cell_service(loop: Loop, link: LinkClient, service: dict[str, Any]) -> Service:
    """The service that passes everything on to the cell.

    Args:
        loop: what serves its connections.
        link: the way to the cell.
        service: what WELCOME said of it.
    """
    name, type_name = service["name"], service["type"]

    def handle(caller: Caller, request: bytes) -> None:
        def answered(frame: Frame) -> None:
            if frame.kind is Kind.DONE:  # in lockstep: it takes time, which others may let pass
                link.ask_again(frame.number, answered)
            elif frame.kind is Kind.ANSWER:
                caller.respond(True, frame.payload)
            else:
                caller.respond(False, b"" if frame.name == NO_ANSWER else one_line(frame.text()))

        try:
            link.request(Kind.CALL, answered, name=name, type=type_name, node=caller.node, payload=request)
        except FrameError as error:
            caller.respond(False, one_line(str(error)))

    return Service(loop, name, type_name, service["md5"], handle)


def one_line(text: str) -> bytes:
    """A reason as ROS carries it."""
    return " ".join(text.split()).encode()
