"""The bridge as a guest of the cell: one connection, requests that are answered later, messages as they come."""

from __future__ import annotations

import socket
import threading
from typing import Any, Callable

from cellwright.middleware.ros1.bridge.loop import Loop
from cellwright.middleware.ros1.bridge.outlet import Outlet
from cellwright.middleware.ros1.bridge.received import received
from cellwright.middleware.ros1.bridge.report import report
from cellwright.middleware.wire.frames import LONGEST_SAID, Decoder, Frame, FrameError, Kind, hello

PATIENCE = 10.0
"""How long the cell may take to answer HELLO [s]."""

_PIECE = 1 << 18
_PAUSE = 0.02
_NUMBERS = (1 << 32) - 1

Answered = Callable[[Frame], None]
"""Takes the frame that answers a request; called by the loop's thread."""


class LinkError(Exception):
    """The cell cannot be attached to; the text says why."""


class LinkClient:
    """A connection to a cell.

    Requests may be made from any thread; answers and messages are delivered by the loop's.

    Args:
        loop: what serves the connection.
        address: host and port of the cell.
        node: the name to be known by.
        on_end: called once: with the reason when the cell has ended, with None when it is gone without a word.

    Raises:
        LinkError: nobody answers there, or not as a cell does.
    """

    def __init__(self, loop: Loop, address: tuple[str, int], node: str, on_end: Callable[[str | None], None]) -> None:
        self._loop = loop
        self._on_end = on_end
        self._is_behind: Callable[[], bool] = lambda: False
        self._decoder = Decoder()
        self._lock = threading.Lock()
        self._number = 0
        self._answers: dict[int, Answered] = {}
        self._listeners: dict[int, Callable[[bytes], None]] = {}
        self._has_ended = False
        try:
            self._connection = socket.create_connection(address, timeout=PATIENCE)
            self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.welcome: dict[str, Any] = self._greet(node)
        except OSError as error:
            raise LinkError(f"no cell answers at {address[0]}:{address[1]}: {error}") from None
        except FrameError as error:
            raise LinkError(f"what answers at {address[0]}:{address[1]} is no cell: {error}") from None
        self._connection.setblocking(False)
        self._outlet = Outlet(loop, self._connection, self._read)

    def request(self, kind: Kind, answered: Answered | None, **fields: Any) -> int:
        """Send a request, whose answer goes to `answered`; its number."""
        with self._lock:
            self._number = number = self._number % _NUMBERS + 1
            if answered is not None:
                self._answers[number] = answered
        try:
            self._outlet.send(Frame(kind, number, **fields).encode(LONGEST_SAID))
        except FrameError:
            with self._lock:
                self._answers.pop(number, None)
            raise
        return number

    def ask_again(self, number: int, answered: Answered) -> None:
        """Have another answer to a request given to `answered`; to be called while the one before it is taken."""
        with self._lock:
            self._answers[number] = answered

    def subscribe(self, topic: str, node: str, listener: Callable[[bytes], None], answered: Answered) -> int:
        """Have the messages of a topic given to `listener`, from one publishing node or from all (empty).

        Returns:
            The number of the subscription. Its answer goes to `answered`, after what is latched.
        """
        number = self.request(Kind.SUBSCRIBE, answered, name=topic, node=node)
        self._listeners[number] = listener
        return number

    def unsubscribe(self, number: int) -> None:
        """End a subscription; what is still on its way is not delivered any more."""
        self._listeners.pop(number, None)
        self._outlet.send(Frame(Kind.UNSUBSCRIBE, number).encode())

    def keep_up(self, is_behind: Callable[[], bool]) -> None:
        """Ask the cell to let time stand while this end is behind.

        Args:
            is_behind: whether messages that came are still on their way; asked by the loop's thread.
        """
        self._is_behind = is_behind
        self._pong(0)

    def close(self) -> None:
        """Let go of the cell."""
        self._has_ended = True
        self._outlet.close()

    def _greet(self, node: str) -> dict[str, Any]:
        self._connection.sendall(hello(node, "ros1").encode())
        while True:
            data = self._connection.recv(_PIECE)
            if not data:
                raise FrameError("it has hung up")
            for frame in self._decoder.feed(data):
                if frame.kind is Kind.WELCOME:
                    return frame.json()
                raise FrameError(frame.text() or frame.kind.name)

    def _read(self) -> None:
        data = received(self._connection, _PIECE)
        if data is None:
            return
        if not data:
            self._end(None)
            return
        try:
            for frame in self._decoder.feed(data):
                if not self._has_ended:
                    self._take(frame)
        except FrameError as error:
            report(f"what the cell says makes no sense: {error}")
            self._end("")

    def _take(self, frame: Frame) -> None:
        if frame.kind is Kind.MESSAGE:
            listener = self._listeners.get(frame.number)
            if listener is not None:
                listener(frame.payload)
        elif frame.kind is Kind.PING:
            self._answer(frame.number)
        elif frame.kind is Kind.ENDED:
            self._end(frame.text())
        else:
            with self._lock:
                answered = self._answers.pop(frame.number, None)
            if answered is not None:
                answered(frame)

    def _answer(self, ping: int) -> None:
        """Answer a PING once all that came before is on its way."""
        if self._has_ended:
            return
        if self._is_behind():
            self._loop.later(_PAUSE, lambda: self._answer(ping))
        else:
            self._pong(ping)

    def _pong(self, number: int) -> None:
        self._outlet.send(Frame(Kind.PONG, number).encode())

    def _end(self, reason: str | None) -> None:
        if not self._has_ended:
            self.close()
            self._on_end(reason)
