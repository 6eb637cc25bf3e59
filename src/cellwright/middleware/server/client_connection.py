"""Client connection of the server: socket, subscriptions, send buffer and heartbeat."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator

from cellwright.middleware.wire.frames import LONGEST_SAID, Decoder, Frame, Kind


class ReasonCounter:
    """Keeps the first of many reasons, and counts the others. It is false while there is none."""

    def __init__(self) -> None:
        self._first = ""
        self._count = 0

    def __bool__(self) -> bool:
        return self._count > 0

    def add(self, reason: str) -> None:
        """Take note of one."""
        self._first = self._first or reason
        self._count += 1

    def take(self) -> str:
        """What there was, in a line; from then on it counts anew."""
        more = f" (and {self._count - 1} more since the last report)" if self._count > 1 else ""
        line, self._first, self._count = f"{self._first}{more}", "", 0
        return line


PING_PERIOD = 0.02
"""Wall time [s] between an answer and the next PING."""

LATE = 0.1
"""A guest is behind when its answer takes longer than this [s]."""

MAX_HELD = 10.0
"""Longest time [s] for which simulation time stands for guests; one whose answer takes longer must answer first."""

REGAINED = 4.0
"""Seconds of `MAX_HELD` that guests get back for each second in which time does not stand for them."""

_MAX_LOOK_INTERVAL = 0.5  # [s]; more between two looks is a pause, in which time stood for another reason


class Heartbeat:
    """PING and PONG of one guest, on the wall clock.

    Example:
        >>> heartbeat = Heartbeat(now=0.0)
        >>> heartbeat.ping(0.02)
        1
        >>> heartbeat.is_late(0.1), heartbeat.is_late(0.2), heartbeat.is_late(20.0)
        (False, True, False)
        >>> heartbeat.pong(1, 0.3)
        >>> heartbeat.is_late(0.31)
        False
    """

    def __init__(self, now: float) -> None:
        self._number = 0
        self._sent: float | None = None  # when the PING was sent that is not answered yet
        self._next = now

    def ping(self, now: float) -> int:
        """The number of the PING that is due; 0 when none is."""
        if self._sent is not None or now < self._next:
            return 0
        self._number = self._number % 0xFFFFFFFF + 1
        self._sent = now
        return self._number

    def pong(self, number: int, now: float) -> None:
        """Take an answer; one to another PING than the last says nothing."""
        if number == self._number and self._sent is not None:
            self._sent, self._next = None, now + PING_PERIOD

    def is_late(self, now: float) -> bool:
        """Whether the answer is late, but not so late that nobody waits for it any longer."""
        return self._sent is not None and LATE < now - self._sent < LATE + MAX_HELD


class HoldBudget:
    """For how long time may stand for all guests together: `MAX_HELD` at a stretch, four fifths in the long run.

    One account for all: a guest that leaves and comes again begins none of its own.
    """

    def __init__(self, now: float) -> None:
        self._looked = now
        self._left = MAX_HELD

    def may_stand(self, now: float, *, is_wanted: bool) -> bool:
        """Whether time stands until the next look; to be asked again and again, also when nobody wants it to."""
        passed, self._looked = min(now - self._looked, _MAX_LOOK_INTERVAL), now
        if is_wanted and self._left > 0.0:
            self._left -= passed
            return True
        self._left = min(MAX_HELD, self._left + REGAINED * passed)
        return False


BEHIND = 1 << 20
"""With so many bytes waiting for a guest nothing more is read from it, and in lockstep no time passes."""

FULL = 4 << 20
"""With so many that were offered to it and not taken its messages are dropped; earlier where there are many guests."""

AT_ONCE = 32 << 20
"""With so many that were not offered to it yet as well: pictures of several cameras may be told in one tick."""

MOST_WAITING = 256 << 20
"""So many bytes may wait for all guests together."""

LONGEST_HELLO = 1 << 16
"""Bytes of the longest frame that is taken of somebody who has not said who it is."""

_PIECE = 1 << 16


class ClientConnection:
    """A connection, of which nothing is expected: neither that it reads, nor that it speaks, nor sense."""

    def __init__(self, connection: socket.socket, host: str) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connection = connection
        self.host = host
        self.node = ""
        """Its name; empty before it has said HELLO."""
        self.encoding = ""
        """The form of its messages: `cdr` or `ros1`."""
        self.has_key = False
        """Whether it has shown the server's key."""
        self.subscriptions: dict[int, Callable[[], None]] = {}
        """What ends each subscription, by its number."""
        self.has_news = False
        """Whether a message that is not quiet was sent to it since time was last given back to it."""
        self.dropped = 0
        """Messages dropped since that was last said."""
        self.full = FULL
        """With so many bytes waiting its messages are dropped."""
        self.is_heavy = False
        """Whether what it asked for last took long to carry out."""
        self.heartbeat: Heartbeat | None = None
        """Tells how far it is behind; None unless it asked for PINGs."""
        self.untold = ReasonCounter()
        """Why messages could not be put into a form for it, since that was last said."""
        self.is_gone = False
        """Nothing more can be said or heard."""
        self.is_leaving = False
        """Nothing more is heard from it; it is gone as soon as it has taken what waits for it."""
        self.came = time.monotonic()
        """When it came [s] of wall time."""
        self.stuck_since: float | None = None
        """Since when [s] of wall time it has taken nothing of what waits for it; None if it does."""
        self._decoder = Decoder(LONGEST_HELLO)
        self._frames: Iterator[Frame] | None = None
        self._out = bytearray()
        self._left = 0  # bytes of them that it did not take when they were offered

    @property
    def name(self) -> str:
        """The guest as people know it."""
        return self.node or f"a connection from {self.host}"

    @property
    def has_waiting(self) -> bool:
        """Whether something waits to be sent."""
        return bool(self._out)

    @property
    def begun(self) -> int:
        """Bytes that are kept of what it has begun to say."""
        return self._decoder.begun

    @property
    def is_behind(self) -> bool:
        """Whether so much waits for it that it has to read first."""
        return len(self._out) >= BEHIND

    @property
    def has_frames(self) -> bool:
        """Whether there may be frames to carry out among the bytes that were read."""
        return self._frames is not None and not self.is_behind

    @property
    def may_be_read(self) -> bool:
        """Whether more may be read from it: all that came before is done with, and it takes what it is told."""
        return self._frames is None and not (self.is_leaving or self.is_gone or self.is_behind)

    def greet(self, node: str, encoding: str) -> None:
        """Take note of who it is, and let it say more from now on."""
        self.node, self.encoding = node, encoding
        self._decoder.longest = LONGEST_SAID

    def read(self) -> None:
        """Take in what has come. A guest that has hung up is gone."""
        try:
            data = self.connection.recv(_PIECE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if data:
            self._frames = self._decoder.feed(data)
        else:
            self.is_gone = True

    def next_frame(self) -> Frame | None:
        """The next frame that has come; None when there is no whole one.

        Raises:
            FrameError: what has come makes no sense.
        """
        frame = None if self._frames is None or self.is_behind else next(self._frames, None)
        if frame is None and not self.is_behind:
            self._frames = None
        return frame

    def say(self, frame: Frame) -> None:
        """Send a frame, behind what waits already."""
        self._out += frame.encode()

    def tell(self, number: int, message: bytes, *, is_quiet: bool) -> None:
        """Send a message of a subscription; dropped and counted when the guest does not keep up.

        Raises:
            FrameError: it is too long to be sent at all.
        """
        if self._left >= self.full or len(self._out) - self._left >= AT_ONCE:
            self.dropped += 1
            return
        self.say(Frame(Kind.MESSAGE, number, payload=message))
        self.has_news = self.has_news or not is_quiet

    def flush(self) -> None:
        """Hand over as much of what waits as the guest takes now."""
        if self._out and not self.is_gone:
            try:
                sent = self.connection.send(self._out)
            except (BlockingIOError, InterruptedError):
                sent = 0
            except OSError:
                self.is_gone = True
                return
            del self._out[:sent]
            self._left = len(self._out)
            if sent:
                self.stuck_since = None
            elif self.stuck_since is None:
                self.stuck_since = time.monotonic()
        if self.is_leaving and not self._out:
            self.is_gone = True

    def stop_hearing(self) -> None:
        """Hear nothing more from it; it leaves once it has been told what waits for it."""
        self.is_leaving = True
        self._frames = None
        self._decoder = Decoder(0)
        self.flush()

    def close(self) -> None:
        """Listen to nothing any more, and close the connection."""
        self.is_gone = True
        for cancel in self.subscriptions.values():
            cancel()
        self.subscriptions.clear()
        self.connection.close()
