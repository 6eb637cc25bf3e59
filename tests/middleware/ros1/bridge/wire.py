"""ROS 1 on the wire, by hand: subscribers and callers that do exactly what the test says, and no more."""

from __future__ import annotations

import socket
import struct
import xmlrpc.client
from typing import Any, cast

from tests.ros1.ground import Ground
from tests.waiting import TIMEOUT


def address_of(ground: Ground, topic: str, node: str = "/gazebo") -> tuple[str, int]:
    """Where a node wants subscribers of a topic to connect."""
    with xmlrpc.client.ServerProxy(ground.ask("lookupNode", node)) as slave:
        code, message, value = cast("tuple[int, str, Any]", slave.requestTopic("/test", topic, [["TCPROS"]]))
    assert code == 1, message
    return str(value[1]), int(value[2])


def address_of_service(ground: Ground, service: str) -> tuple[str, int]:
    """Where a service is."""
    host, _, port = ground.ask("lookupService", service).removeprefix("rosrpc://").rpartition(":")
    return host, int(port)


def encoded(fields: dict[str, str]) -> bytes:
    """A handshake."""
    lines = [f"{key}={value}".encode() for key, value in fields.items()]
    data = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(data)) + data


OPENED: list[Connection] = []
"""Every connection made; a test's are closed when it is over."""


class Connection:
    """A connection that has shaken hands; `header` is what the other side said."""

    def __init__(self, address: tuple[str, int], fields: dict[str, str], *, receive_buffer: int = 0) -> None:
        self.socket = socket.socket()
        OPENED.append(self)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(TIMEOUT)
        self.socket.connect(address)
        self.socket.sendall(encoded(fields))
        data = self.piece()
        self.header: dict[str, str] = {}
        while data:
            (length,) = struct.unpack_from("<I", data)
            key, _, value = data[4 : 4 + length].decode().partition("=")
            self.header[key] = value
            data = data[4 + length :]

    def read(self, size: int) -> bytes:
        """So many bytes."""
        data = b""
        while len(data) < size:
            more = self.socket.recv(size - len(data))
            if not more:
                raise EOFError
            data += more
        return data

    def piece(self) -> bytes:
        """A piece with its length in front: a handshake or a message."""
        (length,) = struct.unpack("<I", self.read(4))
        return self.read(length)

    def close(self) -> None:
        """Hang up."""
        self.socket.close()


def subscribe(
    ground: Ground, topic: str, *, node: str = "/gazebo", caller: str = "/test", receive_buffer: int = 0, **more: str
) -> Connection:
    """Subscribe to a topic of a node."""
    fields = {"topic": topic, "md5sum": "*", "type": "*", "callerid": caller} | more
    return Connection(address_of(ground, topic, node), fields, receive_buffer=receive_buffer)


class Calls(Connection):
    """A connection to a service."""

    def __init__(self, ground: Ground, service: str, *, caller: str = "/test", **more: str) -> None:
        fields = {"service": service, "md5sum": "*", "callerid": caller} | more
        super().__init__(address_of_service(ground, service), fields)

    def call(self, request: bytes) -> tuple[bool, bytes]:
        """Whether the call succeeded, and the response or the reason."""
        self.ask(request)
        return self.answer()

    def ask(self, request: bytes) -> None:
        """Send a request, and do not wait."""
        self.socket.sendall(struct.pack("<I", len(request)) + request)

    def answer(self) -> tuple[bool, bytes]:
        """Wait for the answer."""
        return bool(self.read(1)[0]), self.piece()
