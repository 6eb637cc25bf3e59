"""Connections without blocking: address, receiving, a buffered connection, and the client of a cell's server."""

from __future__ import annotations

import argparse
import socket
import threading
import time
from collections import deque
from typing import Any, Callable

from cellwright.middleware.wire.event_loop import Callback, EventLoop, MissingError, nothing, report
from cellwright.middleware.wire.frames import MAX_CLIENT_FRAME_BYTES, Decoder, Frame, FrameError, FrameKind, hello

LATE = 0.1  # data that waits longer [s] is late
GIVE_UP_TIME = 5.0  # if data waits longer [s], the peer no longer counts as behind
_PIECE = 1 << 18
CONNECT_TIMEOUT = 10.0  # time for the cell to answer HELLO [s]
_PAUSE = 0.02
_NUMBERS = (1 << 32) - 1

Answered = Callable[[Frame], None]  # takes the frame that answers a request; called by the loop's thread


def address_of(text: str) -> tuple[str, int]:
    """Return host and port of `HOST:PORT`, for an option."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 1 << 16:
        raise argparse.ArgumentTypeError(f"{text!r} is not an address; write it like 127.0.0.1:11399")
    return host, int(port)


def receive_nowait(connection: socket.socket, max_bytes: int) -> bytes | None:
    """Return received data, up to `max_bytes` bytes: None if there is none yet, empty at the end of the stream."""
    try:
        return connection.recv(max_bytes)
    except (BlockingIOError, InterruptedError):
        return None
    except OSError:
        return b""


class BufferedConnection:
    """Connection whose data waits until the peer takes it. `send` is for any thread, all else for the loop's.

    A piece is sent whole or not at all, so that only whole messages are dropped. At most `limit` pieces and `max_bytes`
    bytes wait, but always at least one piece. The oldest pieces make room, with a call of `on_drop` for each. `on_end`
    is called when the peer has hung up and the connection is closed.
    """

    def __init__(
        self,
        loop: EventLoop,
        connection: socket.socket,
        on_data: Callable[[bytes], object] = nothing,
        on_end: Callback = nothing,
        *,
        limit: int | None = None,
        max_bytes: int | None = None,
        on_drop: Callback = nothing,
    ) -> None:
        self._loop = loop
        self._connection = connection
        self._on_data = on_data
        self._on_end = on_end
        self._limit = limit
        self._max_bytes = max_bytes
        self._bytes = 0  # of waiting pieces
        self._on_drop = on_drop
        self._lock = threading.Lock()
        self._rest = b""  # unsent part of a piece whose beginning was sent
        self._waiting: deque[bytes] = deque()
        self._on_empty: Callback | None = None
        self._waits_since: float | None = None
        self.is_closed = False
        loop.watch(connection, self._receive)

    @property
    def is_empty(self) -> bool:
        """True if nothing waits to be sent."""
        return not self._rest and not self._waiting

    @property
    def is_behind(self) -> bool:
        """True if data has waited longer than LATE, but not longer than HOPELESS: then the peer does not read."""
        since = self._waits_since
        return since is not None and LATE < time.monotonic() - since < GIVE_UP_TIME

    def send(self, data: bytes) -> None:
        """Send a piece, now or when the peer takes it. Only reading detects that the peer is gone."""
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
        """Close the connection once everything has been sent; data received until then is dropped."""
        with self._lock:
            if not self.is_empty:
                self._on_empty = self.close
                return
        self.close()

    def close(self) -> None:
        """Close the connection, and drop what waits."""
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
        """True if there is no room for one more piece of `more` bytes."""
        is_crowded = self._limit is not None and len(self._waiting) >= self._limit
        return is_crowded or (self._max_bytes is not None and self._bytes + more > self._max_bytes)

    def _receive(self) -> None:
        data = receive_nowait(self._connection, _PIECE)
        if data:
            self._on_data(data)
        elif data is not None:
            self.close()
            self._on_end()

    def _sent(self, data: bytes) -> bytes:
        """Send what the socket takes at once; return the rest."""
        try:
            sent = self._connection.send(data)
        except (BlockingIOError, InterruptedError):
            return data
        except OSError:  # the peer is gone: reading detects it too, and closes
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
            self._loop.watch(self._connection, self._receive)
            if self._on_empty is not None:
                self._on_empty()

    def _watch(self) -> None:
        if not self.is_closed and not self.is_empty:
            self._loop.watch(self._connection, self._receive, self._flush)


class LinkClient:
    """Connection of a node to a cell; a MissingError if there is no answer, or it is not a cell's.

    Any thread may send requests; the loop's thread delivers answers and messages. It calls `on_end` once, with the
    reason if the cell has ended, and with None if the connection broke. It calls `on_notice` with each line about input
    that the cell ignored, limited or held.
    """

    def __init__(
        self,
        loop: EventLoop,
        address: tuple[str, int],
        node: str,
        on_end: Callable[[str | None], None],
        encoding: str = "ros1",
        on_notice: Callable[[str], None] = nothing,
    ) -> None:
        self.loop = loop
        """Loop that delivers answers and messages."""
        self._on_end = on_end
        self._on_notice = on_notice
        self._is_behind: Callable[[], bool] = lambda: False
        self._decoder = Decoder()
        self._lock = threading.Lock()
        self._number = 0
        self._answers: dict[int, Answered] = {}
        self._listeners: dict[int, Callable[[bytes], None]] = {}
        self._has_ended = False
        try:
            connection = socket.create_connection(address, timeout=CONNECT_TIMEOUT)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.welcome: dict[str, Any] = self._greet(connection, node, encoding)
        except OSError as error:
            raise MissingError(f"no cell answers at {address[0]}:{address[1]}: {error}") from None
        except FrameError as error:
            raise MissingError(f"the program at {address[0]}:{address[1]} is not a cell: {error}") from None
        connection.setblocking(False)
        self._connection = BufferedConnection(loop, connection, self._read, lambda: self._end(None))

    def request(self, kind: FrameKind, answered: Answered | None, **fields: Any) -> int:
        """Send a request, whose answer goes to `answered`; return its number."""
        with self._lock:
            self._number = number = self._number % _NUMBERS + 1
            if answered is not None:
                self._answers[number] = answered
        try:
            self._connection.send(Frame(kind, number, **fields).encode(MAX_CLIENT_FRAME_BYTES))
        except FrameError:
            with self._lock:
                self._answers.pop(number, None)
            raise
        return number

    def ask_again(self, number: int, answered: Answered) -> None:
        """Expect another answer to a request, for `answered`; call it while handling the previous answer."""
        with self._lock:
            self._answers[number] = answered

    def subscribe(self, topic: str, node: str, listener: Callable[[bytes], None], answered: Answered) -> int:
        """Subscribe `listener` to the messages of a topic from one publishing node, or from all (empty).

        Returns:
            The number of the subscription; its answer goes to `answered`, after latched messages.
        """
        number = self.request(FrameKind.SUBSCRIBE, answered, name=topic, node=node)
        self._listeners[number] = listener
        return number

    def unsubscribe(self, number: int) -> None:
        """End a subscription; messages in transit are no longer delivered."""
        self._listeners.pop(number, None)
        self._connection.send(Frame(FrameKind.UNSUBSCRIBE, number).encode())

    def keep_up(self, is_behind: Callable[[], bool]) -> None:
        """Ask the cell to hold time while this end is behind: while received messages are not delivered yet."""
        self._is_behind = is_behind
        self._pong(0)

    def close(self) -> None:
        """Close the connection."""
        self._has_ended = True
        self._connection.close()

    def _greet(self, connection: socket.socket, node: str, encoding: str) -> dict[str, Any]:
        connection.sendall(hello(node, encoding, notices=True).encode())
        while True:
            data = connection.recv(_PIECE)
            if not data:
                raise FrameError("it closed the connection")
            for frame in self._decoder.feed(data):
                if frame.kind is FrameKind.WELCOME:
                    return frame.json()
                raise FrameError(frame.text() or frame.kind.name)

    def _read(self, data: bytes) -> None:
        try:
            for frame in self._decoder.feed(data):
                if not self._has_ended:
                    self._take(frame)
        except FrameError as error:
            report(f"invalid data from the cell: {error}")
            self._end("")

    def _take(self, frame: Frame) -> None:
        if frame.kind is FrameKind.MESSAGE:
            listener = self._listeners.get(frame.number)
            if listener is not None:
                listener(frame.payload)
        elif frame.kind is FrameKind.PING:
            self._answer(frame.number)
        elif frame.kind is FrameKind.NOTICE:
            self._on_notice(frame.text())
        elif frame.kind is FrameKind.ENDED:
            self._end(frame.text())
        else:
            with self._lock:
                answered = self._answers.pop(frame.number, None)
            if answered is not None:
                answered(frame)

    def _answer(self, ping: int) -> None:
        """Answer a PING once all earlier messages are sent."""
        if self._has_ended:
            return
        if self._is_behind():
            self.loop.later(_PAUSE, lambda: self._answer(ping))
        else:
            self._pong(ping)

    def _pong(self, number: int) -> None:
        self._connection.send(Frame(FrameKind.PONG, number).encode())

    def _end(self, reason: str | None) -> None:
        if not self._has_ended:
            self.close()
            self._on_end(reason)
