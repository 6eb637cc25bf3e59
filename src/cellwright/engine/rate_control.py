"""Rate control: pause, single steps and speed of a simulation, and its pace against the wall clock."""

import math
import time
from collections.abc import Callable
from threading import Lock

from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UsageError

_TIMEOUT = 0.5
_MAX_WAIT = 0.05  # [s] at a time, so that a change of the rate takes effect soon


class RateControl:
    """Rate control that may change while time passes, at any time and from any thread.

    The loop calls `take` before each tick. The rate is not part of a run's state: the same ticks follow each other,
    only later or sooner.

    Example:
        >>> rate = RateControl(2.0)
        >>> rate.pause()
        >>> rate.step(3)
        >>> rate.speed, rate.is_paused, rate.ticks_left
        (2.0, True, 3)

    Args:
        speed: simulated seconds a wall second, above 0; None: as fast as possible.
        paused: True if time stands until `resume` or `step`.

    Raises:
        UsageError: the speed is not a finite number above 0.
    """

    def __init__(self, speed: float | None = None, *, paused: bool = False) -> None:
        self._lock = Lock()
        self._speed = _checked(speed)
        self._is_paused = paused
        self._ticks = 0
        self.changes = 0
        """Number of changes; a pacer restarts its count after each one."""

    @property
    def speed(self) -> float | None:
        """Simulated seconds a wall second; None: as fast as possible."""
        return self._speed

    @property
    def is_paused(self) -> bool:
        """True if time stands, except for requested single steps."""
        return self._is_paused

    @property
    def ticks_left(self) -> int:
        """Number of single steps that remain while time stands."""
        return self._ticks

    def pause(self) -> None:
        """Pause from the next tick on."""
        self._set_paused(is_paused=True)

    def resume(self) -> None:
        """Resume after a pause."""
        self._set_paused(is_paused=False)

    def _set_paused(self, *, is_paused: bool) -> None:
        with self._lock:
            self._is_paused, self._ticks = is_paused, 0
            self.changes += 1

    def step(self, ticks: int = 1) -> None:
        """Step a number of ticks, in addition to those that remain, and pause then.

        Raises:
            UsageError: a number below 1.
        """
        if ticks < 1:
            raise UsageError(f"ticks must be at least 1 (got {ticks})")
        with self._lock:
            self._ticks = ticks + (self._ticks if self._is_paused else 0)
            self._is_paused = True
            self.changes += 1

    def set_speed(self, speed: float | None) -> None:
        """Set the speed; a pause stays.

        Raises:
            UsageError: the speed is not a finite number above 0.
        """
        speed = _checked(speed)
        with self._lock:
            self._speed = speed
            self.changes += 1

    def restart_pace(self) -> None:
        """Make pacers count from now, as after a reset: they do not make up for the jump of time."""
        with self._lock:
            self.changes += 1

    def take(self) -> bool:
        """Request the next tick, before each step; return True if it may pass now."""
        if not self._is_paused:
            return True
        with self._lock:
            if self._is_paused and self._ticks == 0:
                return False
            self._ticks = max(0, self._ticks - 1)
        return True


def _checked(speed: float | None) -> float | None:
    if speed is not None and not 0.0 < speed < math.inf:
        raise UsageError(f"speed must be a finite number above 0 (got {speed})")
    return speed


class RealTimePacer:
    """Pacer that steps a simulation no faster than its rate control allows.

    After a delay of more than half a second, a slow host does not catch up: the pacer counts from there. The same holds
    after a change of the rate: a speed counts from then on, and a pause is not made up for.

    Args:
        simulation: the simulation to step.
        rate: simulated seconds a wall second, above 0; or a `RateControl`, which may change. The caller asks it
            whether a tick may pass at all.
        clock: returns wall time [s]; replaced in tests.
        sleep: waits for a wall time [s]; replaced in tests.

    Raises:
        UsageError: the speed is not a finite number above 0.
    """

    def __init__(
        self,
        simulation: Simulation,
        rate: float | RateControl,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        self._simulation = simulation
        self.rate = rate if isinstance(rate, RateControl) else RateControl(rate)
        """The rate control."""
        self._changes = self.rate.changes
        self._clock = clock
        self._sleep = sleep
        self._started = self._wall = self._stepped = clock()
        self._started_at = self._simulated = self._newest = simulation.now
        self._paused_time = 0.0
        self.held = 0.0
        """Total wall time [s] that `hold` has reported."""
        self.max_lateness = 0.0
        """Largest lateness of a tick [s] of wall time."""

    @property
    def factor(self) -> float:
        """Average real-time factor up to the latest tick, without pauses; 0 before any time."""
        passed = self._stepped - self._started - self._paused_time
        return (self._newest - self._started_at) / 1e9 / passed if passed > 0.0 else 0.0

    def step(self) -> bool:
        """Step one tick, then wait until it is due; return False if there was no time to wait."""
        if self.rate.changes != self._changes:
            self.begin()
        simulation, speed = self._simulation, self.rate.speed
        simulation.step()
        now, self._newest = self._clock(), simulation.clock.now
        if speed is None:
            self._stepped = now
            return False
        ahead = (self._newest - self._simulated) / 1e9 / speed - (now - self._wall)
        self._stepped = now + max(0.0, ahead)
        if ahead > 0.0:
            self._wait(ahead)
            return True
        self.max_lateness = max(self.max_lateness, -ahead)
        # Too late to catch up: a burst of fast ticks would be no real time either, so the count begins again.
        if ahead < -_TIMEOUT:
            self._wall, self._simulated = now, self._newest
        return False

    def hold(self, seconds: float) -> None:
        """Report that time held for a wall time [s]; it is not made up for, and counts for the factor."""
        self._wall += seconds
        self.held += seconds

    def _wait(self, seconds: float) -> None:
        if seconds <= _MAX_WAIT:
            self._sleep(seconds)
            return
        while (left := self._stepped - self._clock()) > 0.0 and self.rate.changes == self._changes:
            self._sleep(min(left, _MAX_WAIT))

    def begin(self) -> None:
        """Count from here, as at the start of a run; wall time since the last tick counts as a pause."""
        self._changes = self.rate.changes
        now = self._clock()
        self._paused_time += now - self._stepped
        self._wall = self._stepped = now
        # 0, unless the time was set meanwhile
        self._started_at += self._simulation.now - self._newest
        self._simulated = self._newest = self._simulation.now
