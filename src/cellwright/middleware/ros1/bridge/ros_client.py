"""ROS client side of the relay: service calls, interface discovery, subscribed and published topics."""

from __future__ import annotations

import socket
import struct
import warnings
from typing import Any, Callable
from urllib.parse import urlparse

import rospy
from rosgraph.network import ROSHandshakeException, decode_ros_handshake_header

from cellwright.middleware.ros1.bridge.message_bytes import has_header
from cellwright.middleware.ros1.bridge.node import Master
from cellwright.middleware.ros1.bridge.tcpros import ANY, handshake_bytes, raw_type
from cellwright.middleware.wire.frames import PROTOCOL
from cellwright.middleware.wire.graph import PublishedTopic, ServiceGoneError, SubscribedTopic
from cellwright.middleware.wire.relay import CLOCK, STEP

CONNECT_TIMEOUT = 5.0  # time for the other node to answer the handshake [s]
_LENGTH = struct.Struct("<I")
_LONGEST = 16 << 20
_LOGGERS = ("/get_loggers", "/set_logger_level")


class ServiceClient:
    """Blocking client of one service; the checksum `*` accepts any type."""

    def __init__(self, master: Master, node: str, name: str, md5: str = ANY) -> None:
        self._master = master
        self._node = node
        self._name = name
        self._md5 = md5
        self._connection: socket.socket | None = None

    def ask_type(self) -> tuple[str, str]:
        """Return name and checksum of the service's type; a ServiceGoneError if it cannot be reached."""
        connection, header = self._connect({"probe": "1"})
        connection.close()
        return header.get("type", ""), header.get("md5sum", "")

    def call(self, request: bytes, timeout: float | None = None) -> tuple[bool, bytes]:
        """Call the service; return True and the response, or False and the error.

        A broken connection is opened again, but a request is not sent twice.

        Args:
            request: bytes of the request.
            timeout: timeout [s]; None for none, since a step of time may take long.

        Raises:
            ServiceGoneError: the service cannot be reached, or ended before it answered.
        """
        if self._connection is not None and _is_broken(self._connection):
            self.close()
        if self._connection is None:
            self._connection, _ = self._connect({"persistent": "1"})
        connection = self._connection
        connection.settimeout(timeout)
        try:
            connection.sendall(_LENGTH.pack(len(request)) + request)
            succeeded = bool(_read(connection, 1)[0])
            return succeeded, _piece(connection)
        except socket.timeout:
            self.close()
            raise ServiceGoneError(
                f"{self._name} has not answered within {timeout:g} s: over ROS 1 in lockstep, time stands during a "
                "call, so a service that takes time cannot answer"
            ) from None
        except OSError as error:
            self.close()
            raise ServiceGoneError(f"connection to {self._name} lost before its answer: {error}") from None

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
            connection = socket.create_connection((address.hostname, address.port), CONNECT_TIMEOUT)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.sendall(handshake_bytes({**fields, **more}))
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
    """True if the peer has hung up. It sends nothing without a request."""
    # Otherwise `recv` would wait for the timeout of an earlier call.
    connection.setblocking(False)
    try:
        return connection.recv(1, socket.MSG_PEEK) == b""
    except (BlockingIOError, InterruptedError):
        return False
    except OSError:
        return True


def _piece(connection: socket.socket) -> bytes:
    (length,) = _LENGTH.unpack(_read(connection, _LENGTH.size))
    if length > _LONGEST:
        raise OSError(f"{length} bytes are too long")
    return _read(connection, length)


def _read(connection: socket.socket, size: int) -> bytes:
    data = bytearray()
    while len(data) < size:
        piece = connection.recv(size - len(data))
        if not piece:
            raise OSError("it closed the connection")
        data += piece
    return bytes(data)


def discover_interface(master: Master, node: str, sign: str = CLOCK) -> dict[str, Any] | None:
    """Return WELCOME for the present interface, without the time; None while the topic `sign` has no publisher."""
    state, types = master.ask("getSystemState"), dict(master.ask("getTopicTypes") or ())
    if state is None:
        return None
    publishers, subscribers, servers = (dict(role) for role in state)
    if sign not in publishers:
        return None
    topics = [
        {
            "name": name,
            "type": types.get(name, ""),
            "md5": "",
            "definition": "",
            "direction": "out" if name in publishers else "in",
            "rate": "",
            "on_event": False,
            "latch": False,
            "publishers": publishers.get(name, []),
            "subscribers": subscribers.get(name, []),
        }
        for name in sorted({*publishers, *subscribers})
    ]
    services = []
    for name in sorted(servers):
        if name.endswith(_LOGGERS):
            continue
        try:
            type_name, md5 = ServiceClient(master, node, name).ask_type()
        except ServiceGoneError:  # registered by a node that is gone
            continue
        services.append({"name": name, "type": type_name, "md5": md5, "node": servers[name][0]})
    return {
        "protocol": PROTOCOL,
        "cellwright": "",
        "trial": "",
        "timestep": [0, 1],
        "lockstep": any(service["name"] == STEP for service in services),
        "competition": None,
        "topics": topics,
        "services": services,
    }


class Ros1Subscription(SubscribedTopic):
    """Subscription in ROS 1, whose messages rospy's threads bring."""

    def __init__(self, name: str, type_name: str, deliver: Callable[[tuple[int, ...], bytes], None]) -> None:
        super().__init__(name, deliver)
        self._header: Any = None
        self._count = 0
        self._subscriber = rospy.Subscriber(name, raw_type(type_name or ANY), self._take, tcp_nodelay=True)

    @property
    def is_connected(self) -> bool:
        """True if a publisher has answered the handshake, and so sends messages."""
        return any(connection.header for connection in self._subscriber.impl.connections)

    def close(self) -> None:
        """Unsubscribe."""
        self._subscriber.unregister()

    def _take(self, message: Any) -> None:
        header = message._connection_header
        with self._changed:  # each publisher has a thread
            if header is not self._header:
                self._header, self._count = header, 0
            self._count += 1
            self.take(message.data, self._count, is_latched=header.get("latching") == "1")


class Ros1Publication(PublishedTopic):
    """Publication in ROS 1."""

    def __init__(self, name: str, type_name: str, md5: str, definition: str) -> None:
        self.name = name
        self.type = type_name
        self.published = 0  # number of messages
        self._has_header = has_header(definition)
        self._class = raw_type(type_name, md5, definition)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it recommends a queue; here nothing must wait
            self._publisher = rospy.Publisher(name, self._class, tcp_nodelay=True, queue_size=None)

    @property
    def is_connected(self) -> bool:
        """True if it has a subscriber."""
        return bool(self._publisher.get_num_connections())

    def publish(self, data: bytes) -> None:
        """Send a message."""
        if self._has_header:
            data = struct.pack("<I", self.published & 0xFFFFFFFF) + data[4:]
        self.published += 1
        self._publisher.publish(self._class(data))
