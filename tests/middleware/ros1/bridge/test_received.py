"""What a connection that waits for nothing has brought."""

from __future__ import annotations

import socket

from cellwright.middleware.ros1.bridge.received import received


def test_nothing_yet_and_nothing_more_are_told_apart() -> None:
    here, there = socket.socketpair()
    here.setblocking(False)
    with here, there:
        assert received(here, 16) is None
        there.sendall(b"word")
        assert received(here, 2) == b"wo"
        assert received(here, 16) == b"rd"
        there.close()
        assert received(here, 16) == b""


def test_a_connection_that_broke_brings_nothing_more() -> None:
    here, there = socket.socketpair()
    here.close()
    with there:
        assert received(here, 16) == b""
