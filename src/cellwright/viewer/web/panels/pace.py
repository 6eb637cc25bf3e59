"""How fast time passes, as it is seen from a page: from what is asked a few times a second."""

from __future__ import annotations

from collections import deque

_SPAN = 2.0  # [s] of wall time that are looked back upon


class SeenPace:
    """Simulated seconds a wall second, over the last two."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque()

    def take(self, wall: float, time: float) -> None:
        """Take note of a simulation time [s] that was told at `wall` [s]."""
        if self._seen and time < self._seen[-1][1]:
            self._seen.clear()  # it has begun anew
        self._seen.append((wall, time))
        while len(self._seen) > 2 and self._seen[0][0] < wall - _SPAN:
            self._seen.popleft()

    @property
    def factor(self) -> float | None:
        """The pace; None as long as it cannot be said."""
        if len(self._seen) < 2:
            return None
        (wall, time), (wall_now, time_now) = self._seen[0], self._seen[-1]
        return (time_now - time) / (wall_now - wall) if wall_now > wall else None
