"""ROS 1 on the wire, by hand: subscribers and callers that do only what the test does."""

from __future__ import annotations

import socket
import struct
import xmlrpc.client
from typing import Any, cast

from tests.ros1.ground import Ground
from tests.support.waiting import TIMEOUT


def address_of(ground: Ground, topic: str, node: str = "/gazebo") -> tuple[str, int]:
    """Return the address at which a node accepts subscribers of a topic."""
    with xmlrpc.client.ServerProxy(ground.ask("lookupNode", node)) as slave:
        code, message, value = cast("tuple[int, str, Any]", slave.requestTopic("/test", topic, [["TCPROS"]]))
    assert code == 1, message
    return str(value[1]), int(value[2])


def address_of_service(ground: Ground, service: str) -> tuple[str, int]:
    """Return the address of a service."""
    host, _, port = ground.ask("lookupService", service).removeprefix("rosrpc://").rpartition(":")
    return host, int(port)


def encoded(fields: dict[str, str]) -> bytes:
    """Return a handshake."""
    lines = [f"{key}={value}".encode() for key, value in fields.items()]
    data = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(data)) + data


OPENED: list[Connection] = []
"""All open connections; they are closed at the end of a test."""


class Connection:
    """Connection after the handshake; `header` is the peer's."""

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
        """Return `size` bytes."""
        data = b""
        while len(data) < size:
            more = self.socket.recv(size - len(data))
            if not more:
                raise EOFError
            data += more
        return data

    def piece(self) -> bytes:
        """Read a piece with its length in front: a handshake or a message."""
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
        """Call; return whether it succeeded, and the response or the error."""
        self.ask(request)
        return self.answer()

    def ask(self, request: bytes) -> None:
        """Send a request, and do not wait."""
        self.socket.sendall(struct.pack("<I", len(request)) + request)

    def answer(self) -> tuple[bool, bytes]:
        """Wait for the answer."""
        return bool(self.read(1)[0]), self.piece()
