"""Connection headers of topics and services, which nodes exchange before the first message.

They are requested without a registration at the master, so that the node graph does not change.
"""

import socket
import struct
import xmlrpc.client
from typing import Any, cast
from urllib.parse import urlparse

from tests.ros1.ground import Ground
from tests.support.waiting import TIMEOUT


def publisher_header(ground: Ground, topic: str, node: str) -> dict[str, str]:
    """Return the header of a publisher for a subscriber that accepts any type.

    Args:
        ground: environment of both.
        topic: its full name.
        node: the publishing node.
    """
    with xmlrpc.client.ServerProxy(ground.ask("lookupNode", node)) as slave:
        answer = cast("tuple[int, str, Any]", slave.requestTopic("/probe", topic, [["TCPROS"]]))
    assert answer[0] == 1, answer
    protocol, host, port = answer[2]
    assert protocol == "TCPROS"
    return _exchange((host, port), {"topic": topic, "type": "*", "md5sum": "*"})


def service_header(ground: Ground, service: str) -> dict[str, str]:
    """Return the header of a service for a client that only probes.

    Args:
        ground: environment of the service.
        service: its full name.
    """
    place = urlparse(ground.ask("lookupService", service))
    assert place.scheme == "rosrpc"
    assert place.hostname is not None
    assert place.port is not None
    return _exchange((place.hostname, place.port), {"service": service, "md5sum": "*", "probe": "1"})


def _exchange(address: tuple[str, int], said: dict[str, str]) -> dict[str, str]:
    fields = [f"{name}={value}".encode() for name, value in {"callerid": "/probe", **said}.items()]
    body = b"".join(struct.pack("<I", len(field)) + field for field in fields)
    with socket.create_connection(address, TIMEOUT) as connection:
        connection.sendall(struct.pack("<I", len(body)) + body)
        (length,) = struct.unpack("<I", _exactly(connection, 4))
        answer, found = _exactly(connection, length), {}
    while answer:
        (length,) = struct.unpack_from("<I", answer)
        name, _, value = answer[4 : 4 + length].decode().partition("=")
        found[name] = value
        answer = answer[4 + length :]
    return found


def _exactly(connection: socket.socket, length: int) -> bytes:
    found = b""
    while len(found) < length:
        more = connection.recv(length - len(found))
        assert more, f"the connection ended after {len(found)} of {length} bytes"
        found += more
    return found
