"""TCPROS: handshakes, opaque message classes, and the server where other nodes connect.

The server replaces rospy's, which reads a handshake in the thread that accepts: one silent connection blocks all
others. From then on, rospy's has a thread for each connection.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
from typing import Any, Callable, Dict, Mapping, Optional

import rosgraph.network
import rospy
import rospy.impl.tcpros_base
from rosgraph.network import decode_ros_handshake_header, encode_ros_handshake_header

from cellwright.middleware.wire.connection import BufferedConnection, receive_nowait
from cellwright.middleware.wire.event_loop import EventLoop

ANY = "*"  # checksum and type that match any
MAX_HANDSHAKE_BYTES = 1 << 20
HANDSHAKE_TIMEOUT = 10.0  # time for a connection to complete its handshake [s]
_PIECE = 1 << 16
_LENGTH = struct.Struct("<I")
_PAUSE = 0.5

Header = Dict[str, str]
Taker = Callable[[socket.socket, Header], Optional[str]]
"""Takes over a connection with its handshake's header; else returns the reason."""


def handshake_bytes(fields: Mapping[str, str]) -> bytes:
    """Return the bytes of a handshake."""
    return bytes(encode_ros_handshake_header(fields))


def raw_type(name: str, md5: str = ANY, definition: str = "") -> Any:
    """Return a rospy message class whose messages have their bytes as `data` and are otherwise opaque."""
    namespace = {
        "__slots__": (),
        "__init__": _hold,
        "data": property(lambda message: message._buff),
        "_type": name,
        "_md5sum": md5,
        "_full_text": definition,
    }
    return type("Raw", (rospy.AnyMsg,), namespace)


def _hold(self: Any, data: bytes = b"") -> None:
    self._buff = data


class TcprosServer:
    """Server that accepts connections and hands them to the topic or service that they name."""

    def __init__(self, loop: EventLoop) -> None:
        self.topics: dict[str, Taker] = {}
        self.services: dict[str, Taker] = {}
        self._loop = loop
        family = socket.AF_INET6 if rosgraph.network.use_ipv6() else socket.AF_INET
        self._listener = socket.socket(family, socket.SOCK_STREAM)
        self._listener.bind((rosgraph.network.get_bind_address(), 0))
        self._listener.listen(128)
        self._listener.setblocking(False)
        self._rospy = rospy.impl.tcpros_base.init_tcpros_server()
        self._rospy.tcp_ros_server = self
        self._watch()

    def get_full_addr(self) -> tuple[str, int]:
        """Return host and port, as rospy reports them to other nodes."""
        return rosgraph.network.get_host_name(), self._listener.getsockname()[1]

    def shutdown(self) -> None:
        """Do nothing: rospy calls this at the node's end, and the sockets end with the process."""

    def _watch(self) -> None:
        self._loop.watch(self._listener, self._accept)

    def _accept(self) -> None:
        try:
            connection, address = self._listener.accept()
        except (BlockingIOError, InterruptedError, ConnectionError):
            return
        except OSError:  # too many are open: some may close soon
            self._loop.forget(self._listener)
            self._loop.later(_PAUSE, self._watch)
            return
        connection.setblocking(False)
        with contextlib.suppress(OSError):  # it is gone again: reading detects it
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        Handshake(self._loop, connection, lambda header: self._route(connection, address, header))

    def _route(self, connection: socket.socket, address: Any, header: Header) -> None:
        """Hand a connection to its topic or service, or refuse it with the reason."""
        kind = "topic" if "topic" in header else "service"
        takers, theirs = {
            "topic": (self.topics, self._rospy.topic_connection_handler),
            "service": (self.services, self._rospy.service_connection_handler),
        }[kind]
        missing = [field for field in (kind, "md5sum", "callerid") if field not in header]
        if missing:
            refuse(self._loop, connection, f"the handshake lacks the field {missing[0]}")
            return
        taker = takers.get(header[kind])
        if taker is None:  # rospy's own: the logs, and the services that set their level
            self._loop.forget(connection)
            threading.Thread(target=_give_away, args=(theirs, connection, address, header), daemon=True).start()
            return
        reason = taker(connection, header)
        if reason is not None:
            rospy.logwarn(f"{header['callerid']} cannot connect: {reason}")
            refuse(self._loop, connection, reason)


class Handshake:
    """Pending handshake of a connection, closed after a timeout."""

    def __init__(self, loop: EventLoop, connection: socket.socket, on_header: Callable[[Header], None]) -> None:
        self._loop = loop
        self._connection = connection
        self._on_header = on_header
        self._data = b""
        self._is_over = False
        loop.watch(connection, self._read)
        loop.later(HANDSHAKE_TIMEOUT, self._give_up)

    def _read(self) -> None:
        data = receive_nowait(self._connection, _PIECE)
        if data is None:
            return
        if not data:
            self._give_up()
            return
        self._data += data
        if len(self._data) < _LENGTH.size:
            return
        (length,) = _LENGTH.unpack_from(self._data)
        if length > MAX_HANDSHAKE_BYTES:
            self._give_up()
        elif len(self._data) >= _LENGTH.size + length:
            try:
                header = decode_ros_handshake_header(self._data)
            except (rosgraph.network.ROSHandshakeException, struct.error, UnicodeDecodeError):
                self._give_up()
                return
            self._is_over = True
            self._on_header(header)

    def _give_up(self) -> None:
        if not self._is_over:
            self._is_over = True
            self._loop.forget(self._connection)
            self._connection.close()


def refuse(loop: EventLoop, connection: socket.socket, reason: str) -> None:
    """Send the peer the reason of the refusal, and close its connection."""
    refused = BufferedConnection(loop, connection)
    refused.send(handshake_bytes({"error": reason}))
    refused.close_when_empty()


def _give_away(handler: Callable[..., str | None], connection: socket.socket, address: Any, header: Header) -> None:
    """Hand a connection to rospy; this may block."""
    try:
        connection.settimeout(HANDSHAKE_TIMEOUT)
        reason = handler(connection, address, header)
        if reason is not None:
            connection.sendall(handshake_bytes({"error": reason}))
            connection.close()
    except Exception:  # any error of rospy with a broken connection: it costs only that connection
        connection.close()
