"""Sending without ever waiting: what the other side does not take yet stays behind, up to a limit."""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from typing import Callable

from cellwright.middleware.ros1.bridge.loop import Callback, Loop

LATE = 0.1
"""Data that waits for longer [s] is late."""

HOPELESS = 5.0
"""With data waiting for longer [s] the other side does not count as behind any more."""


class Outlet:
    """The sending side of a connection. `send` is for any thread, all else for the loop's.

    A piece is sent whole or not at all, so that what is dropped is always a whole message.

    Args:
        loop: waits until the other side takes more.
        connection: a socket that does not block.
        on_read: what the loop calls when there is something to read.
        limit: so many pieces may wait; the oldest ones make room for a new one. None for no limit.
        most: so many bytes may wait, in the same way; one piece always may.
        on_drop: called for each piece that is dropped.
    """

    def __init__(
        self,
        loop: Loop,
        connection: socket.socket,
        on_read: Callback,
        *,
        limit: int | None = None,
        most: int | None = None,
        on_drop: Callable[[], None] = lambda: None,
    ) -> None:
        self._loop = loop
        self._connection = connection
        self._on_read = on_read
        self._limit = limit
        self._most = most
        self._bytes = 0  # of pieces that wait
        self._on_drop = on_drop
        self._lock = threading.Lock()
        self._rest = b""
        """The part of a piece whose beginning has been sent."""
        self._waiting: deque[bytes] = deque()
        self._on_empty: Callback | None = None
        self._waits_since: float | None = None
        self.is_closed = False
        loop.watch(connection, on_read)

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits to be sent."""
        return not self._rest and not self._waiting

    @property
    def is_behind(self) -> bool:
        """Whether data has waited longer than LATE; False again after HOPELESS: nobody reads there."""
        since = self._waits_since
        return since is not None and LATE < time.monotonic() - since < HOPELESS

    def send(self, data: bytes) -> None:
        """Send a piece, now or when the other side takes it. That it is gone is found out by reading."""
        with self._lock:
            if self.is_closed:
                return
            if self.is_empty:
                self._rest = self._sent(data)
                if self._rest:
                    self._waits_since = time.monotonic()
                    self._loop.call(self._watch)
                return
            dropped = 0
            while self._waiting and self._is_full(len(data)):
                self._bytes -= len(self._waiting.popleft())
                dropped += 1
            self._waiting.append(data)
            self._bytes += len(data)
        for _ in range(dropped):
            self._on_drop()

    def close_when_empty(self) -> None:
        """Close the connection once everything has been sent; what comes in until then is read and thrown away."""
        with self._lock:
            if not self.is_empty:
                self._on_empty = self.close
                return
        self.close()

    def close(self) -> None:
        """Close the connection, whatever waits."""
        with self._lock:
            if self.is_closed:
                return
            self.is_closed = True
            self._waiting.clear()
            self._bytes = 0
            self._rest = b""
        self._loop.forget(self._connection)
        self._connection.close()

    def _is_full(self, more: int) -> bool:
        """Whether so many bytes in one piece more are too much."""
        is_crowded = self._limit is not None and len(self._waiting) >= self._limit
        return is_crowded or (self._most is not None and self._bytes + more > self._most)

    def _sent(self, data: bytes) -> bytes:
        """Send what is taken at once; the rest."""
        try:
            sent = self._connection.send(data)
        except (BlockingIOError, InterruptedError):
            return data
        except OSError:  # it is gone: reading says so as well, and then it is closed
            return b""
        return data[sent:] if sent < len(data) else b""

    def _flush(self) -> None:
        with self._lock:
            while not self.is_closed:
                self._rest = self._sent(self._rest) if self._rest else b""
                if self._rest or not self._waiting:
                    break
                self._rest = self._waiting.popleft()
                self._bytes -= len(self._rest)
            empty = self.is_empty
        if empty and not self.is_closed:
            self._waits_since = None
            self._loop.watch(self._connection, self._on_read)
            if self._on_empty is not None:
                self._on_empty()

    def _watch(self) -> None:
        if not self.is_closed and not self.is_empty:
            self._loop.watch(self._connection, self._on_read, self._flush)
