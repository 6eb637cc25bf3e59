"""Receiving without blocking."""

from __future__ import annotations

import socket

from cellwright.middleware.ros1.bridge.connection import receive_nowait


def test_no_data_yet_differs_from_the_end() -> None:
    here, there = socket.socketpair()
    here.setblocking(False)
    with here, there:
        assert receive_nowait(here, 16) is None
        there.sendall(b"word")
        assert receive_nowait(here, 2) == b"wo"
        assert receive_nowait(here, 16) == b"rd"
        there.close()
        assert receive_nowait(here, 16) == b""


def test_a_connection_that_broke_brings_nothing_more() -> None:
    here, there = socket.socketpair()
    here.close()
    with there:
        assert receive_nowait(here, 16) == b""
