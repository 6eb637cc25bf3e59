"""Clients of the server: connections with send buffer and heartbeat, and the registry of those that are there."""

import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator

from cellwright.middleware.wire.frames import LONGEST_SAID, Decoder, Frame, FrameError, Kind
from cellwright.util import errors
from cellwright.util.errors import CellwrightError

PING_PERIOD = 0.02  # wall time [s] between an answer and the next PING
LATE = 0.1  # a guest is behind when its answer takes longer than this [s]

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

MOST_WAITING = 256 << 20  # so many bytes may wait for all guests together
LONGEST_HELLO = 1 << 16  # bytes of the longest frame that is taken of somebody who has not said who it is
_PIECE = 1 << 16


class ClientConnection:
    """A connection, of which nothing is expected: neither that it reads, nor that it speaks, nor sense."""

    def __init__(self, connection: socket.socket, host: str) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connection = connection
        self.host = host
        self.node = ""  # its name; empty before it has said HELLO
        self.encoding = ""  # the form of its messages: `cdr` or `ros1`
        self.has_key = False  # whether it has shown the server's key
        self.subscriptions: dict[int, Callable[[], None]] = {}  # what ends each subscription, by its number
        self.has_news = False
        """Whether a message that is not quiet was sent to it since time was last given back to it."""
        self.dropped = 0  # messages dropped since that was last said
        self.full = FULL  # with so many bytes waiting its messages are dropped
        self.is_heavy = False  # whether what it asked for last took long to carry out
        self.heartbeat: Heartbeat | None = None  # tells how far it is behind; None unless it asked for PINGs
        self.untold: Counter[str] = Counter()  # why messages had no form for it, since that was last said
        self.is_gone = False  # nothing more can be said or heard
        self.is_leaving = False
        """Nothing more is heard from it; it is gone as soon as it has taken what waits for it."""
        self.came = time.monotonic()  # when it came [s] of wall time
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
        """The next frame that has come; None when there is no whole one. A FrameError if it makes no sense."""
        frame = None if self._frames is None or self.is_behind else next(self._frames, None)
        if frame is None and not self.is_behind:
            self._frames = None
        return frame

    def say(self, frame: Frame) -> None:
        """Send a frame, behind what waits already."""
        self._out += frame.encode()

    def tell(self, number: int, message: bytes, *, is_quiet: bool) -> None:
        """Send a message of a subscription; dropped and counted when the guest does not keep up."""
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


def refused_frame(number: int, error: BaseException) -> Frame:
    """The answer that says why not, by the nearest class of error that every guest knows."""
    kinds = type(error).__mro__
    known = next((kind for kind in kinds if kind.__module__ == errors.__name__), CellwrightError)
    return Frame(Kind.REFUSED, number, name=known.__name__, payload=str(error).encode(errors="replace"))


MOST_GUESTS = 200
"""More connections than these are turned away, those first that have not said who they are; `select` can look at
some 1000."""

PATIENCE = 30.0
"""So long [s] a guest may take nothing of what waits for it, or not say who it is, before it is cut off."""

MOST_BEGUN = 64 << 20
"""So many bytes may be kept of what all guests together have begun to say and not ended; who has most is cut off."""

_MOST_NAMED = 10  # guests that were cut off, in one report
_LOOK_AFTER = 1.0  # [s] of wall time between two looks at who is behind, stuck or silent


class ClientRegistry:
    """Those who are there, in the order in which they came.

    `report` takes a line about guests that misbehave, at most one a second for each; `forget` is told who has gone.
    """

    def __init__(self, report: Callable[[str], None], forget: Callable[[ClientConnection], None]) -> None:
        self._report = report
        self._forget = forget
        self._there: list[ClientConnection] = []
        self._cut_off: dict[str, Counter[str]] = {}
        self._waited_for: set[str] = set()
        self._looked = time.monotonic()
        self._standing_time = HoldBudget(self._looked)

    def __iter__(self) -> Iterator[ClientConnection]:
        return iter(self._there)

    def __len__(self) -> int:
        return len(self._there)

    def from_turn(self, turn: int) -> list[ClientConnection]:
        """All of them once, beginning with the one whose turn it is."""
        first = turn % len(self._there) if self._there else 0
        return [*self._there[first:], *self._there[:first]]

    def admit(self, guest: ClientConnection) -> None:
        """Take one in; if there are too many, another may have to go for it."""
        self._there.append(guest)
        self._share_room()
        if len(self._there) > MOST_GUESTS:
            # who has not said who it is makes room: a crowd that says nothing must not keep programs out
            silent = next((each for each in self._there if not each.node and not each.is_leaving), guest)
            self.cut(silent, FrameError(f"there are {MOST_GUESTS} guests already"))

    def cut(self, guest: ClientConnection, error: FrameError) -> None:
        """Tell a guest why nothing more is heard from it; it leaves once it has been told."""
        guest.say(refused_frame(0, error))
        guest.stop_hearing()
        self._note_cut(guest, str(error))

    def forget_those_gone(self) -> None:
        """Let go of those to whom nothing more can be said; the others share their room."""
        for guest in [guest for guest in self._there if guest.is_gone]:
            self._there.remove(guest)
            self._forget(guest)
            guest.close()
        self._share_room()

    def close(self) -> None:
        """Let go of all of them."""
        self._tell_who_was_cut_off()
        for guest in self._there:
            guest.close()
        self._there.clear()

    def _share_room(self) -> None:
        """Give each guest its part of what may wait for all."""
        for guest in self._there:
            guest.full = min(FULL, MOST_WAITING // len(self._there))

    def ping(self) -> None:
        """Send the PINGs that are due."""
        now = time.monotonic()
        for guest in self._there:
            if guest.heartbeat is not None and not guest.is_leaving and (number := guest.heartbeat.ping(now)):
                guest.say(Frame(Kind.PING, number))

    def hold_time(self) -> bool:
        """Whether simulation time stands for guests that are behind; the first time that it does is reported."""
        now = time.monotonic()
        late = [guest for guest in self._there if guest.heartbeat is not None and guest.heartbeat.is_late(now)]
        late = [guest for guest in late if not guest.is_leaving and not guest.is_gone]
        if not self._standing_time.may_stand(now, is_wanted=bool(late)):
            return False
        for guest in late:
            if guest.name not in self._waited_for and len(self._waited_for) < _MOST_NAMED:
                self._waited_for.add(guest.name)
                self._report(f"time stands while {guest.name} is more than {LATE:g} s behind; this is said once")
        return True

    def limit_what_is_begun(self) -> None:
        """Part with whoever has begun most and not ended it, until it is little enough for all together."""
        while sum(guest.begun for guest in self._there) > MOST_BEGUN:
            greatest = max(self._there, key=lambda guest: guest.begun)
            self.cut(greatest, FrameError("all guests together have begun too much and not ended it"))

    @property
    def next_look(self) -> float:
        """How long it is [s] until they are to be looked after again."""
        return max(0.0, self._looked + _LOOK_AFTER - time.monotonic())

    def look_after(self) -> None:
        """Once a second: say what happened to guests, and part with those that are hopeless."""
        now = time.monotonic()
        if now - self._looked < _LOOK_AFTER:
            return
        self._looked = now
        for guest in self._there:
            if guest.dropped:
                self._report(f"{guest.name} does not read as fast as it is told: {guest.dropped} messages were dropped")
                guest.dropped = 0
            if guest.untold:
                self._report(f"{guest.name} cannot be told: {_first(guest.untold)}")
                guest.untold.clear()
            is_stuck = guest.stuck_since is not None and now - guest.stuck_since > PATIENCE
            if is_stuck and (guest.is_behind or guest.is_leaving):
                guest.is_gone = True
                self._note_cut(guest, f"it has read nothing for {PATIENCE:g} s")
            elif not guest.node and not guest.is_leaving and now - guest.came > PATIENCE:
                self.cut(guest, FrameError(f"it has not said who it is for {PATIENCE:g} s"))
        self._tell_who_was_cut_off()

    def _tell_who_was_cut_off(self) -> None:
        for name, reasons in self._cut_off.items():
            self._report(f"cut off {name}: {_first(reasons)}")
        self._cut_off.clear()

    def _note_cut(self, guest: ClientConnection, reason: str) -> None:
        """Take note of it for the next report; names come from outside, and beyond some the others share a line."""
        name = guest.name if guest.name in self._cut_off or len(self._cut_off) < _MOST_NAMED else "others"
        self._cut_off.setdefault(name, Counter())[reason] += 1


def _first(reasons: Counter[str]) -> str:
    """The first of many reasons, and how many there were after it."""
    more = reasons.total() - 1
    return next(iter(reasons)) + (f" (and {more} more since the last report)" if more else "")
