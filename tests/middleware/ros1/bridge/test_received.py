"""What a connection that waits for nothing has brought."""

from __future__ import annotations

import socket

from cellwright.middleware.ros1.bridge.connection import receive_nowait


def test_nothing_yet_and_nothing_more_are_told_apart() -> None:
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
