"""Heartbeat of a guest: how far it is behind, and for how long simulation time may stand for it."""

from __future__ import annotations

PERIOD = 0.02
"""Wall time [s] between an answer and the next PING."""

LATE = 0.1
"""A guest is behind when its answer takes longer than this [s]."""

MAX_HELD = 10.0
"""Longest time [s] for which simulation time stands for a guest; after that the guest must answer first."""

REGAINED = 4.0
"""Seconds of `MAX_HELD` that a guest gets back for each second in which time does not stand for it."""

_LONGEST_LOOK = 0.5  # [s]; more between two looks is a pause, in which time stood for another reason


class Heartbeat:
    """PING and PONG of one guest, on the wall clock.

    Simulation time stands while an answer is late, up to a limit: a guest that never answers holds time once, for
    `MAX_HELD`, and one that answers now and then for at most four fifths of the time.

    Example:
        >>> heartbeat = Heartbeat(now=0.0)
        >>> heartbeat.ping(0.02)
        1
        >>> heartbeat.is_held(0.1), heartbeat.is_held(0.2)
        (False, True)
        >>> heartbeat.pong(1, 0.3)
        >>> heartbeat.is_held(0.31)
        False
    """

    def __init__(self, now: float) -> None:
        self._number = 0
        self._sent: float | None = None  # when the PING was sent that is not answered yet
        self._next = now
        self._looked = now
        self._credit = MAX_HELD
        self._is_trusted = True

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
            self._is_trusted = True

    def is_held(self, now: float) -> bool:
        """Whether simulation time stands for this guest; to be asked again and again while it does."""
        passed, self._looked = min(now - self._looked, _LONGEST_LOOK), now
        is_late = self._sent is not None and now - self._sent > LATE
        if not (is_late and self._is_trusted):
            self._credit = min(MAX_HELD, self._credit + REGAINED * passed)
            return False
        self._credit -= passed
        self._is_trusted = self._credit > 0.0
        return self._is_trusted
