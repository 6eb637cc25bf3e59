"""Buffered connection: pieces in order and whole, the oldest dropped, closed when everything is sent."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.wire.connection import BufferedConnection
from cellwright.middleware.wire.event_loop import EventLoop
from tests.support.waiting import TIMEOUT


class Line:
    """Connection and its other end, with buffers so small that it is soon full."""

    def __init__(self, limit: int | None = None, max_bytes: int | None = None) -> None:
        self.loop = EventLoop()
        self.here, self.there = socket.socketpair()
        for end, option in ((self.here, socket.SO_SNDBUF), (self.there, socket.SO_RCVBUF)):
            end.setsockopt(socket.SOL_SOCKET, option, 2048)
            end.setblocking(False)
        self.dropped = 0
        self.heard: list[bytes] = []
        self.has_ended = False
        self.connection = BufferedConnection(
            self.loop, self.here, self.heard.append, self._end, limit=limit, max_bytes=max_bytes, on_drop=self._count
        )
        self.got = b""

    def _count(self) -> None:
        self.dropped += 1

    def _end(self) -> None:
        self.has_ended = True
        self.loop.stop(0)

    def drain(self) -> bytes:
        """Let the loop send until nothing waits; return all received bytes."""

        def look() -> None:
            try:
                while data := self.there.recv(1 << 16):
                    self.got += data
            except BlockingIOError:
                if not (self.connection.is_empty or self.connection.is_closed):
                    return
            self.loop.stop(0)

        self.loop.watch(self.there, look)
        self.loop.later(0.0, look)  # if nothing waits, nothing will come
        self.loop.later(TIMEOUT, lambda: self.loop.stop(1))
        assert self.loop.run() == 0
        return self.got

    def close(self) -> None:
        self.connection.close()
        self.there.close()
        self.loop.close()


@pytest.fixture
def line() -> Iterator[Line]:
    made = Line()
    yield made
    made.close()


@given(st.lists(st.integers(1, 9000), max_size=12))
def test_connection_sends_everything_in_order(sizes: list[int]) -> None:
    line = Line()
    pieces = [bytes([number]) * size for number, size in enumerate(sizes)]
    for piece in pieces:
        line.connection.send(piece)
    assert line.drain() == b"".join(pieces)
    line.close()


def test_connection_beyond_limit_drops_oldest_whole_piece() -> None:
    line = Line(limit=3)
    pieces = [bytes([number]) * 50_000 for number in range(10)]
    for piece in pieces:
        line.connection.send(piece)
    assert line.dropped == 6
    assert line.drain() == b"".join([pieces[0], *pieces[-3:]])  # the first was in transit
    line.close()


def test_close_when_empty_sends_everything_first(line: Line) -> None:
    line.connection.send(b"x" * 100_000)
    line.connection.close_when_empty()
    closed = [line.connection.is_closed]

    def look() -> None:
        data = line.there.recv(1 << 16)
        line.got += data
        if not data:
            line.loop.stop(0)

    line.loop.watch(line.there, look)
    line.loop.run()
    assert line.got == b"x" * 100_000
    assert [*closed, line.connection.is_closed] == [False, True]
    line.connection.send(b"into the void")


def test_close_when_empty_closes_idle_connection_at_once(line: Line) -> None:
    line.connection.close_when_empty()
    assert line.connection.is_closed
    line.connection.close()


def test_connection_with_closed_peer_ends(line: Line) -> None:
    line.there.close()
    for _ in range(3):
        line.connection.send(b"hello")
    assert line.connection.is_empty


def test_connection_passes_on_received_data_and_end(line: Line) -> None:
    line.there.sendall(b"a word")
    line.there.close()
    line.loop.run()
    assert b"".join(line.heard) == b"a word"
    assert line.has_ended
    assert line.connection.is_closed


@given(st.lists(st.integers(1, 60_000), min_size=1, max_size=12))
def test_connection_keeps_newest_bytes_within_limit(sizes: list[int]) -> None:
    line = Line(max_bytes=100_000)
    pieces = [bytes([number]) * size for number, size in enumerate(sizes)]
    for piece in pieces:
        line.connection.send(piece)
        assert sum(map(len, line.connection._waiting)) <= 100_000
    out = line.drain()
    assert out.endswith(pieces[-1])
    assert len(set(out)) + line.dropped == len(pieces)
    line.close()


def test_connection_keeps_one_piece_beyond_byte_limit() -> None:
    line = Line(max_bytes=1000)
    pieces = [bytes([number]) * 50_000 for number in range(4)]
    for piece in pieces:
        line.connection.send(piece)
    assert line.drain() == pieces[0] + pieces[3]
    assert line.dropped == 2
    line.close()
