"""Invalid clients at the bridge's ports: they lose their connection, and others lose nothing."""

from __future__ import annotations

import random
import socket
import struct
import xmlrpc.client
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from cellwright.middleware.wire.frames import FrameKind
from tests.middleware.ros1.bridge.conftest import start_bridge
from tests.middleware.ros1.bridge.fake_cell import FakeCell, out, service
from tests.middleware.ros1.bridge.wire import Connection, address_of, address_of_service, encoded
from tests.ros1.ground import Ground
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures", "tests.middleware.ros1.bridge.fixtures"]

pytestmark = pytest.mark.ros1

MakeCell = Callable[..., FakeCell]
MEGABYTE = 1 << 20

BOMB = (
    b"<?xml version='1.0'?><!DOCTYPE l [<!ENTITY a0 'aaaaaaaaaa'>"
    + b"".join(b"<!ENTITY a%d '%s'>" % (k, b"&a%d;" % (k - 1) * 10) for k in range(1, 10))
    + b"]><methodCall><methodName>&a9;</methodName></methodCall>"
)
"""Some hundred bytes that an XML reader could expand to ten thousand million."""


@pytest.fixture
def connections() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def memory(process: Process) -> int:
    """Return the memory of a process [bytes]."""
    return int(Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * 4096


def posted(body: bytes, length: int | None = None) -> bytes:
    """Return an HTTP request with a given Content-Length."""
    return b"POST / HTTP/1.1\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n" % (length or len(body)) + body


def is_well(master: Ground) -> bool:
    """Return whether the bridge still answers nodes, forwards a call, and accepts a subscriber."""
    with xmlrpc.client.ServerProxy(master.ask("lookupNode", "/gazebo")) as slave:
        if slave.getPid("/test")[0] != 1:  # type: ignore[index]
            return False
    address_of(master, "/words")
    call = Connection(
        address_of_service(master, "/trigger"), {"service": "/trigger", "md5sum": "*", "callerid": "/test"}
    )
    call.socket.sendall(struct.pack("<I", 0))
    return call.read(1) == b"\x01"


def test_foreign_bytes_at_both_ports_do_not_stop_bridge(
    master: Ground, make_cell: MakeCell, connections: ExitStack
) -> None:
    cell = make_cell([out("/words")], [service("/trigger")])
    bridge = start_bridge(master, cell)
    assert is_well(master)
    host, port = master.ask("lookupNode", "/gazebo").removeprefix("http://").rstrip("/").split(":")
    xml, tcp = (host, int(port)), address_of_service(master, "/trigger")
    before = memory(bridge)

    def stranger(address: tuple[str, int], *pieces: bytes) -> socket.socket:
        connection = connections.enter_context(socket.create_connection(address, timeout=TIMEOUT))
        with suppress(OSError):  # the bridge may have hung up
            for piece in pieces:
                connection.sendall(piece)
        return connection

    draw = random.Random(0)
    for address in (xml, tcp):
        for _ in range(60):
            stranger(address, draw.randbytes(draw.randint(0, 3000)))
        stranger(address, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        stranger(address, b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(200))
    # handshakes that announce a great length, have wrong field lengths, or name an unknown topic
    stranger(tcp, struct.pack("<I", 0xFFFFFFFF), bytes(MEGABYTE))
    stranger(tcp, struct.pack("<II", 8, 0xFFFFFFFF), b"abcd")
    stranger(tcp, struct.pack("<I", 1 << 20), bytes(MEGABYTE))
    stranger(tcp, encoded({"topic": "/none", "md5sum": "*", "callerid": "/x"}))
    stranger(tcp, encoded({"service": "/none", "md5sum": "*", "callerid": "/x"}))
    stranger(tcp, encoded({"service": "/trigger", "md5sum": "*", "callerid": "/x"}), b"\xff\xff\xff\xff")
    stranger(tcp, encoded({"topic": "/words", "md5sum": "*", "callerid": "/x\n\x1b[2J"}))
    # a request that never ends, one without a length, and one that expands when it is read
    long = stranger(xml, posted(b"", 4_000_000_000), *[bytes(MEGABYTE)] * 100)
    assert b"413" in received(long)
    assert b"413" in received(stranger(xml, b"POST / HTTP/1.1\r\nContent-Length: x\r\n\r\n"))
    stranger(xml, posted(BOMB))
    for method in ("publisherUpdate", "requestTopic", "paramUpdate", "getBusInfo", "shutdown_"):
        for arguments in ((), (None,), (1, 2, 3), ("/x", "/words", [["TCPROS"] * 1000])):
            body = xmlrpc.client.dumps(arguments, method, allow_none=True).encode()
            stranger(xml, posted(body))
    wait_until(lambda: is_well(master), "an answer")
    assert memory(bridge) - before < 60 * MEGABYTE
    assert len(cell.of(FrameKind.CALL)) >= 2


def received(connection: socket.socket) -> bytes:
    """Return the beginning of an answer; empty if there is none."""
    with suppress(OSError):
        return connection.recv(200)
    return b""
