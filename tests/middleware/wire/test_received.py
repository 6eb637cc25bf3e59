"""Receiving without blocking."""

from __future__ import annotations

import socket

from cellwright.middleware.wire.connection import receive_nowait


def test_recv_without_data_differs_from_end() -> None:
    here, there = socket.socketpair()
    here.setblocking(False)
    with here, there:
        assert receive_nowait(here, 16) is None
        there.sendall(b"word")
        assert receive_nowait(here, 2) == b"wo"
        assert receive_nowait(here, 16) == b"rd"
        there.close()
        assert receive_nowait(here, 16) == b""


def test_recv_of_broken_connection_returns_end() -> None:
    here, there = socket.socketpair()
    here.close()
    with there:
        assert receive_nowait(here, 16) == b""
