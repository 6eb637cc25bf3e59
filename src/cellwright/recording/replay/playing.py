"""Playing a recording to guests, and what becomes of time at its end."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

from cellwright.engine.tempo import Tempo
from cellwright.middleware.server import Server
from cellwright.middleware.server.timekeeper import Timekeeper
from cellwright.recording.replay.recorded import Recorded


class AtEnd(Enum):
    """What becomes of time when all has been played."""

    STOP = "stop"
    """Playing is over."""
    HOLD = "hold"
    """Time stands. Whoever lets it pass again sees all from the start."""
    LOOP = "loop"
    """It begins again."""


class Playing:
    """Lets the time of a recording pass for guests.

    Args:
        recorded: what is played.
        server: serves the guests.
        tempo: how time is to pass.
        first, last: simulation times [ns] from which and up to which it is played; None: all of it.
        at_end: what becomes of time then.
        on_poll: called about ten times a second of wall time.
    """

    def __init__(
        self,
        recorded: Recorded,
        server: Server,
        *,
        tempo: Tempo,
        first: int | None = None,
        last: int | None = None,
        at_end: AtEnd = AtEnd.STOP,
        on_poll: Callable[[], None] = lambda: None,
    ) -> None:
        begin, end = recorded.source.begin, recorded.source.end_time
        self.first = begin if first is None else min(max(first, begin), end)
        """Simulation time [ns] from which it is played."""
        self.last = end if last is None else min(max(last, self.first), end)
        """Simulation time [ns] up to which it is played."""
        self.recorded = recorded
        """What is played."""
        self.tempo = tempo
        """How its time passes."""
        self._at_end = at_end
        self.keeper = Timekeeper(recorded, server, tempo=tempo, on_poll=on_poll)
        recorded.seek(self.first)

    def stop(self) -> None:
        """Let it end before the next tick; to be called from anywhere, a signal's handler included."""
        self.keeper.is_stopped = True

    def seek(self, time: int) -> int:
        """Go to a time [ns]; the time at which it stands then [ns]."""
        now = self.recorded.seek(time)
        self.tempo.begin_anew()
        return now

    def begin_anew(self) -> None:
        """Go to where it begins."""
        self.seek(self.first)

    def resume(self) -> None:
        """Let time pass again: from the start, where it stands at the end."""
        if self.recorded.simulation.now >= self.last:
            self.recorded.seek(self.first)
        self.tempo.resume()

    def run(self) -> None:
        """Play until it is over, or stopped."""
        while not self.keeper.is_stopped:
            self.keeper.run(lambda: self.last)
            if self.keeper.is_stopped or self._at_end is AtEnd.STOP:
                return
            if self._at_end is AtEnd.LOOP and self.last > self.first:
                self.begin_anew()
            else:
                self._hold()

    def _hold(self) -> None:
        """Serve guests while time stands at the end."""
        self.tempo.pause()
        while not self.keeper.is_stopped and self.recorded.simulation.now >= self.last:
            self.keeper.tick()
            if self.recorded.simulation.now > self.last:  # a step past the end leads nowhere
                self.seek(self.last if self.tempo.is_paused else self.first)
