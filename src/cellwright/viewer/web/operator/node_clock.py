"""The clock of a robot's node, known by what the node told of it last: commands are stamped with it."""

from __future__ import annotations

_FASTEST = 100.0  # seconds of the node in one of ours
_LONG_ENOUGH = 0.01  # [s] between two tellings, to tell how fast it goes
_FAR = 0.25  # [s]: for no longer than this it is thought to have gone on


class NodeClock:
    """Goes on between two tellings as fast as it went, so that it is right at any speed, and stands when time does."""

    def __init__(self) -> None:
        self._stamp, self._heard, self._rate = 0, float("-inf"), 1.0

    def hear(self, stamp: int, now: float) -> None:
        """The node's clock showed `stamp` [ns] at `now` [s] of this one's."""
        gone = now - self._heard
        if gone >= _LONG_ENOUGH:
            rate = (stamp - self._stamp) / 1e9 / gone
            self._rate = min(max(rate, 0.0), _FASTEST) if gone < float("inf") else 1.0
        self._stamp, self._heard = stamp, now

    def at(self, now: float) -> int:
        """What it shows at `now` [s]; 0, which says nothing, before it was heard of."""
        gone = now - self._heard
        if gone == float("inf"):
            return 0
        return self._stamp + round(min(max(gone, 0.0), _FAR) * self._rate * 1e9)
