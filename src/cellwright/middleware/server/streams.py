"""Streams: answers that the server sends to one call unasked, one after another, such as frames for a page.

A client says how many answers it takes before it asks for more. So one that reads slowly, or not at all, has few of
them to read. The server makes the answers for all streams in one go, so that they share what is costly.
"""

import logging
import math
import time
from dataclasses import dataclass
from typing import Protocol

from cellwright.middleware.server.clients import ClientConnection, refused_frame
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind
from cellwright.util.errors import CellwrightError, ServiceFailedError

PERIOD = 1 / 20
"""Shortest wall time [s] between two answers of a stream."""
MAX_AHEAD = 100
"""Largest number of answers that a client may take before it asks for more."""
_SHARE = 0.1  # largest share of wall time that answers take: those of a large cell come less often
_EARLY = 0.01  # [s] by which answers may be early, so that they are made at the end of a tick and not in its pause

log = logging.getLogger(__name__)


class AnswerStream(Protocol):
    """Further answers to one call of a service."""

    ahead: int
    """Number of answers that the client takes before it asks for more: 1 to `MAX_AHEAD`."""

    def next(self, at: float) -> bytes | None:
        """Return the payload of the next DATA frame; None if there is no news.

        Args:
            at: wall time [s], the same for all streams that are served in one go.
        """
        ...


@dataclass(slots=True)
class _OpenStream:
    number: int
    stream: AnswerStream
    left: int


class Streams:
    """Open streams, one of each client at most.

    Example:
        >>> streams = Streams()
        >>> streams.due
        inf
        >>> streams.serve(2.0, 0.0)  # none is open
        False
    """

    def __init__(self) -> None:
        self._open: dict[ClientConnection, _OpenStream] = {}
        self._next = 0.0
        self.due = math.inf
        """Wall time [s] of the next answers; infinite without a stream."""

    def begin(self, client: ClientConnection, number: int, stream: AnswerStream) -> None:
        """Begin the stream of a client's call, in place of its earlier one."""
        self._open[client] = _OpenStream(number, stream, stream.ahead)
        self.due = self._next

    def renew(self, client: ClientConnection, number: int) -> bool:
        """Let the stream of this number go on; return False if the client has no such stream."""
        found = self._open.get(client)
        if found is None or found.number != number:
            return False
        found.left = found.stream.ahead
        return True

    def end(self, client: ClientConnection, number: int | None = None) -> None:
        """End the client's stream, if it has one, of this number."""
        found = self._open.get(client)
        if found is not None and number in (None, found.number):
            del self._open[client]
            if not self._open:
                self.due = math.inf

    def serve(self, now: float, left: float) -> bool:
        """Send the answers that are due; return whether any were.

        A client that has not taken what waits for it gets a later one.

        Args:
            now: wall time [s].
            left: wall time [s] until the next tick: what is due before it is sent now.
        """
        due = self.due
        if due > now + min(left, _EARLY):
            return False
        for client, found in list(self._open.items()):
            if found.left and not client.has_waiting and not client.is_leaving:
                self._answer(client, found, now)
        spent = time.perf_counter() - now
        # The times of the answers keep their rhythm, unless they are late or take long.
        on_time = due + PERIOD if due > now - PERIOD else now + PERIOD
        self._next = max(on_time, now + spent / _SHARE)
        self.due = self._next if self._open else math.inf
        return True

    def _answer(self, client: ClientConnection, found: _OpenStream, now: float) -> None:
        try:
            payload = found.stream.next(now)
            if payload is None:
                return
            found.left -= 1
            client.send(Frame(FrameKind.DATA, found.number, payload=payload))
        except (CellwrightError, FrameError) as error:
            client.send(refused_frame(found.number, error))
            self.end(client)
        except Exception as error:  # a defect of Cellwright must not end the run of all others
            log.exception("stream %d of %s", found.number, client.name)
            failed = ServiceFailedError(f"the cell failed: {type(error).__name__}: {error}")
            client.send(refused_frame(found.number, failed))
            self.end(client)
        client.flush()
