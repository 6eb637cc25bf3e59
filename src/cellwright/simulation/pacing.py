"""Wall-clock pace around a simulation. The only place in the core that knows of real time."""

from __future__ import annotations

import time
from collections.abc import Callable

from cellwright.errors import UsageError
from cellwright.simulation.simulation import Simulation

_PATIENCE = 0.5


class Pacer:
    """Steps a simulation no faster than `speed` times real time.

    A host too slow to keep up is not made to catch up by a rush: when more than half a second is missing, the pace is
    taken up anew from there.

    Args:
        simulation: what is stepped.
        speed: simulated seconds a wall second, above 0.
        clock, sleep: wall time [s] and how to wait for it; to be replaced in tests.
    """

    def __init__(
        self,
        simulation: Simulation,
        speed: float,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if not 0.0 < speed < float("inf"):
            raise UsageError(f"a speed must be above 0, not {speed}")
        self._simulation = simulation
        self._speed = speed
        self._clock = clock
        self._sleep = sleep
        self._begun = self._wall = self._stepped = clock()
        self._begun_at = self._simulated = simulation.now
        self.worst = 0.0
        """How late [s] of wall time the latest tick came."""

    @property
    def factor(self) -> float:
        """Simulated seconds a wall second, on average up to the newest tick; 0 before any time has passed."""
        passed = self._stepped - self._begun
        return (self._simulation.now - self._begun_at) / 1e9 / passed if passed > 0.0 else 0.0

    def step(self) -> bool:
        """One tick, then the wait until it is time for it; False when there was no time to wait."""
        simulation = self._simulation
        simulation.step()
        now = self._clock()
        ahead = (simulation.now - self._simulated) / 1e9 / self._speed - (now - self._wall)
        self._stepped = now + max(0.0, ahead)
        if ahead > 0.0:
            self._sleep(ahead)
            return True
        self.worst = max(self.worst, -ahead)
        if ahead < -_PATIENCE:
            self._wall, self._simulated = now, simulation.now
        return False
