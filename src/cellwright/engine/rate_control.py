"""Rate control: pause, single steps and speed of a simulation, and its pace against the wall clock."""

import math
import time
from collections.abc import Callable
from threading import Lock

from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UsageError


class RateControl:
    """A tempo that may change while time passes, at any moment and from any thread.

    Who lets time pass asks it before each tick. It is no part of a run's state: the same ticks follow each other, only
    later or sooner.

    Args:
        speed: simulated seconds a wall second, above 0; None: as fast as it goes.
        paused: whether time stands until somebody says otherwise.

    Raises:
        UsageError: a speed that is none.
    """

    def __init__(self, speed: float | None = None, *, paused: bool = False) -> None:
        self._lock = Lock()
        self._speed = _checked(speed)
        self._is_paused = paused
        self._ticks = 0
        self.changes = 0
        """How often it was changed: who has kept pace by the old one begins anew."""

    @property
    def speed(self) -> float | None:
        """Simulated seconds a wall second; None: as fast as it goes."""
        return self._speed

    @property
    def is_paused(self) -> bool:
        """Whether time stands, but for ticks that were asked for."""
        return self._is_paused

    @property
    def ticks_left(self) -> int:
        """So many ticks may pass while time stands."""
        return self._ticks

    def pause(self) -> None:
        """Let time stand, from the next tick on."""
        self._set_paused(is_paused=True)

    def resume(self) -> None:
        """Let time pass again."""
        self._set_paused(is_paused=False)

    def _set_paused(self, *, is_paused: bool) -> None:
        with self._lock:
            self._is_paused, self._ticks = is_paused, 0
            self.changes += 1

    def step(self, ticks: int = 1) -> None:
        """Let so many ticks pass, beside those that are still to come, and time stand then.

        Raises:
            UsageError: a number below 1.
        """
        if ticks < 1:
            raise UsageError(f"at least one tick can be asked for, not {ticks}")
        with self._lock:
            self._ticks = ticks + (self._ticks if self._is_paused else 0)
            self._is_paused = True
            self.changes += 1

    def set_speed(self, speed: float | None) -> None:
        """Go at another speed; whether time stands is another matter.

        Raises:
            UsageError: a speed that is none.
        """
        speed = _checked(speed)
        with self._lock:
            self._speed = speed
            self.changes += 1

    def begin_anew(self) -> None:
        """Have who keeps pace count from now, as after a reset: time has been set, and nothing is to be caught up."""
        with self._lock:
            self.changes += 1

    def take(self) -> bool:
        """Ask for the next tick, as who lets time pass does before each: whether it may pass now."""
        if not self._is_paused:
            return True
        with self._lock:
            if self._is_paused and self._ticks == 0:
                return False
            self._ticks = max(0, self._ticks - 1)
        return True


def _checked(speed: float | None) -> float | None:
    if speed is not None and not 0.0 < speed < math.inf:
        raise UsageError(f"a speed must be above 0, not {speed}")
    return speed


_PATIENCE = 0.5
_LONGEST_WAIT = 0.05  # [s] at a time, so that a tempo that changes is heard soon


class RealTimePacer:
    """Steps a simulation no faster than a tempo says.

    A host too slow to keep up is not made to catch up by a rush: when more than half a second is missing, the pace is
    taken up anew from there. So it is when the tempo changes: a speed holds from then on, and a pause is not made good.

    Args:
        simulation: what is stepped.
        tempo: simulated seconds a wall second, above 0; or a `RateControl`, which may change. Whether it lets a tick
            pass at all is for the caller to ask.
        clock, sleep: wall time [s] and how to wait for it; to be replaced in tests.

    Raises:
        UsageError: a speed that is none.
    """

    def __init__(
        self,
        simulation: Simulation,
        tempo: float | RateControl,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._simulation = simulation
        self.tempo = tempo if isinstance(tempo, RateControl) else RateControl(tempo)
        """How time is to pass."""
        self._changes = self.tempo.changes
        self._clock = clock
        self._sleep = sleep
        self._begun = self._wall = self._stepped = clock()
        self._begun_at = self._simulated = self._newest = simulation.now
        self._rested = 0.0
        self.stood = 0.0
        """So long [s] of wall time `stand` has added up."""
        self.worst = 0.0
        """How late [s] of wall time the latest tick came."""

    @property
    def factor(self) -> float:
        """Simulated seconds a wall second, on average up to the newest tick, pauses left out; 0 before any time."""
        passed = self._stepped - self._begun - self._rested
        return (self._newest - self._begun_at) / 1e9 / passed if passed > 0.0 else 0.0

    def step(self) -> bool:
        """One tick, then the wait until it is time for it; False when there was no time to wait."""
        if self.tempo.changes != self._changes:
            self.begin()
        simulation, speed = self._simulation, self.tempo.speed
        simulation.step()
        now, self._newest = self._clock(), simulation.now
        if speed is None:
            self._stepped = now
            return False
        ahead = (self._newest - self._simulated) / 1e9 / speed - (now - self._wall)
        self._stepped = now + max(0.0, ahead)
        if ahead > 0.0:
            self._wait(ahead)
            return True
        self.worst = max(self.worst, -ahead)
        if ahead < -_PATIENCE:
            self._wall, self._simulated = now, self._newest
        return False

    def stand(self, seconds: float) -> None:
        """Take note that time stood for so long [s] of wall time: it is not made good, and counts for the factor."""
        self._wall += seconds
        self.stood += seconds

    def _wait(self, seconds: float) -> None:
        if seconds <= _LONGEST_WAIT:
            self._sleep(seconds)
            return
        while (left := self._stepped - self._clock()) > 0.0 and self.tempo.changes == self._changes:
            self._sleep(min(left, _LONGEST_WAIT))

    def begin(self) -> None:
        """Count from here, as at the start of a run: wall time since the last tick is a rest, and is not made good."""
        self._changes = self.tempo.changes
        now = self._clock()
        self._rested += now - self._stepped
        self._wall = self._stepped = now
        self._begun_at += self._simulation.now - self._newest  # 0, unless its time was set meanwhile
        self._simulated = self._newest = self._simulation.now
