"""Calling a service of another node, over a connection that stays."""

from __future__ import annotations

import socket
import struct
from urllib.parse import urlparse

from rosgraph.network import ROSHandshakeException, decode_ros_handshake_header

from cellwright.middleware.ros1.bridge.handshakes import handshake
from cellwright.middleware.ros1.bridge.master import Master
from cellwright.middleware.ros1.bridge.raw_types import ANY

CONNECT = 5.0
"""How long the other node may take to answer the handshake [s]."""

_LENGTH = struct.Struct("<I")
_LONGEST = 16 << 20


class ServiceGoneError(Exception):
    """The service cannot be reached; the text says why."""


class ServiceClient:
    """One service as a caller sees it. It blocks.

    Args:
        master: knows where it is.
        node: the caller's name.
        name: of the service.
        md5: checksum of its type, or `*` for whatever it has.
    """

    def __init__(self, master: Master, node: str, name: str, md5: str = ANY) -> None:
        self._master = master
        self._node = node
        self._name = name
        self._md5 = md5
        self._connection: socket.socket | None = None

    def ask_type(self) -> tuple[str, str]:
        """Name and checksum of the service's type.

        Raises:
            ServiceGoneError: it cannot be reached.
        """
        connection, header = self._connect({"probe": "1"})
        connection.close()
        return header.get("type", ""), header.get("md5sum", "")

    def call(self, request: bytes, patience: float | None = None) -> tuple[bool, bytes]:
        """Whether the call succeeded, and the response, or the reason why not.

        Args:
            request: in the form of ROS 1.
            patience: how long [s] the answer may take; None for ever, for a step of time may take long.

        A connection that was broken meanwhile is made anew, but a request is not sent twice.

        Raises:
            ServiceGoneError: it cannot be reached, or went before it answered.
        """
        connection = self._connection
        if connection is not None and _is_broken(connection):
            self.close()
            connection = None
        if connection is None:
            connection, _ = self._connect({"persistent": "1"})
            self._connection = connection
        connection.settimeout(patience)
        try:
            connection.sendall(_LENGTH.pack(len(request)) + request)
            succeeded = bool(_read(connection, 1)[0])
            return succeeded, _piece(connection)
        except socket.timeout:
            self.close()
            raise ServiceGoneError(
                f"{self._name} has not answered in {patience:g} s; over ROS 1 in lockstep no time passes while a call "
                "waits, and its answer may need some"
            ) from None
        except OSError as error:
            self.close()
            raise ServiceGoneError(f"{self._name} has gone before it answered: {error}") from None

    def close(self) -> None:
        """Hang up."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _connect(self, more: dict[str, str]) -> tuple[socket.socket, dict[str, str]]:
        uri = self._master.ask("lookupService", self._name)
        if not uri:
            raise ServiceGoneError(f"there is no service {self._name}")
        address = urlparse(uri)
        fields = {"service": self._name, "md5sum": self._md5, "callerid": self._node}
        connection = None
        try:
            connection = socket.create_connection((address.hostname, address.port), CONNECT)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.sendall(handshake({**fields, **more}))
            data = _piece(connection)
            header = decode_ros_handshake_header(_LENGTH.pack(len(data)) + data)
        except (OSError, ValueError, ROSHandshakeException, struct.error) as error:
            if connection is not None:
                connection.close()
            raise ServiceGoneError(f"{self._name} does not answer: {error}") from None
        if "error" in header:
            connection.close()
            raise ServiceGoneError(f"{self._name}: {header['error']}")
        return connection, header


def _is_broken(connection: socket.socket) -> bool:
    """Whether the other side has hung up. It says nothing unasked."""
    connection.setblocking(False)  # a limit of time that an earlier call has set would be waited for
    try:
        return connection.recv(1, socket.MSG_PEEK) == b""
    except (BlockingIOError, InterruptedError):
        return False
    except OSError:
        return True


def _piece(connection: socket.socket) -> bytes:
    (length,) = _LENGTH.unpack(_read(connection, _LENGTH.size))
    if length > _LONGEST:
        raise OSError(f"{length} bytes are too many")
    return _read(connection, length)


def _read(connection: socket.socket, size: int) -> bytes:
    data = bytearray()
    while len(data) < size:
        piece = connection.recv(size - len(data))
        if not piece:
            raise OSError("it has hung up")
        data += piece
    return bytes(data)
