"""How time is to pass: whether it stands, how many ticks may pass all the same, and how fast it goes.

A tempo is told from outside, at any moment and from any thread; who lets time pass asks it before each tick. It is no
part of a run's state: the same ticks follow each other, only later or sooner.
"""

from __future__ import annotations

import math
from threading import Lock

from cellwright.util.errors import UsageError


class Tempo:
    """A tempo that may change while time passes.

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
        with self._lock:
            self._is_paused, self._ticks = True, 0
            self.changes += 1

    def resume(self) -> None:
        """Let time pass again."""
        with self._lock:
            self._is_paused, self._ticks = False, 0
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
