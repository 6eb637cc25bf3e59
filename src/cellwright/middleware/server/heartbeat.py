"""Heartbeat of a guest: how far it is behind, and for how long simulation time may stand for guests."""

from __future__ import annotations

PERIOD = 0.02
"""Wall time [s] between an answer and the next PING."""

LATE = 0.1
"""A guest is behind when its answer takes longer than this [s]."""

MAX_HELD = 10.0
"""Longest time [s] for which simulation time stands for guests; one whose answer takes longer must answer first."""

REGAINED = 4.0
"""Seconds of `MAX_HELD` that guests get back for each second in which time does not stand for them."""

_LONGEST_LOOK = 0.5  # [s]; more between two looks is a pause, in which time stood for another reason


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
            self._sent, self._next = None, now + PERIOD

    def is_late(self, now: float) -> bool:
        """Whether the answer is late, but not so late that nobody waits for it any longer."""
        return self._sent is not None and LATE < now - self._sent < LATE + MAX_HELD


class StandingTime:
    """For how long time may stand for all guests together: `MAX_HELD` at a stretch, four fifths in the long run.

    One account for all: a guest that leaves and comes again begins none of its own.
    """

    def __init__(self, now: float) -> None:
        self._looked = now
        self._left = MAX_HELD

    def may_stand(self, now: float, *, is_wanted: bool) -> bool:
        """Whether time stands until the next look; to be asked again and again, also when nobody wants it to."""
        passed, self._looked = min(now - self._looked, _LONGEST_LOOK), now
        if is_wanted and self._left > 0.0:
            self._left -= passed
            return True
        self._left = min(MAX_HELD, self._left + REGAINED * passed)
        return False
