"""Listening sockets: a port that is in use, and a process without descriptors."""

from __future__ import annotations

import os
import select
import socket
import sys
from collections.abc import Iterator

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.server import server as module
from cellwright.middleware.server.server import LOOPBACK, ListeningSocket, Server, open_listener
from cellwright.util.errors import UsageError
from tests.support.cells import BARE
from tests.support.waiting import TIMEOUT


@pytest.fixture
def busy() -> Iterator[int]:
    """A port that is in use."""
    with open_listener(LOOPBACK, 0) as listener:
        yield int(listener.getsockname()[1])


def test_port_in_use_is_refused_or_next_one_is_used(busy: int) -> None:
    with pytest.raises(UsageError, match=f"{LOOPBACK}:{busy}: cannot listen: "):
        open_listener(LOOPBACK, busy)
    with open_listener(LOOPBACK, busy, tries=20) as listener:
        assert busy < listener.getsockname()[1] < busy + 20


def test_server_without_port_uses_default_or_next_free_one(busy: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "DEFAULT_PORT", busy)
    elsewhere = Server(Cell(BARE), port=None)
    free = Server(Cell(BARE), port=0)
    try:
        assert elsewhere.address[1] > busy
        assert (elsewhere.busy_port, free.busy_port) == (busy, 0)
    finally:
        elsewhere.close("over")
        free.close("over")


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
def test_connections_without_free_descriptors_are_closed() -> None:
    import resource

    listener = ListeningSocket(open_listener(LOOPBACK, 0))
    address = listener.socket.getsockname()
    clients = [socket.create_connection(address, TIMEOUT) for _ in range(5)]
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    free = os.dup(0)
    os.close(free)
    resource.setrlimit(resource.RLIMIT_NOFILE, (free, hard))
    try:
        taken = [listener.accept() for _ in clients]
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert taken == [None] * 5
    assert not select.select([listener.socket], [], [], 0.0)[0], "no connection is left in the queue"
    assert [client.recv(1) for client in clients] == [b""] * 5
    with socket.create_connection(address, TIMEOUT):
        come = listener.accept()
        assert come is not None
        assert come[1] == LOOPBACK
        come[0].close()
    for client in clients:
        client.close()
    listener.close()
