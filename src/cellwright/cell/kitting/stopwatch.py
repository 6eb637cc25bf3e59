"""A stopwatch over simulation time: it is told the time, so it is exact whenever somebody looks."""

from collections.abc import Sequence

from cellwright.util.errors import UsageError


class Stopwatch:
    """Adds up the time [ns] between `run` and `halt`."""

    def __init__(self) -> None:
        self._before = 0
        self._since: int | None = None

    def run(self, now: int) -> None:
        """Run from `now` [ns] on; while it runs already, nothing changes."""
        if self._since is None:
            self._since = now

    def halt(self, now: int) -> None:
        """Stand still from `now` [ns] on."""
        self._before = self.elapsed(now)
        self._since = None

    def elapsed(self, now: int) -> int:
        """Time it has run until `now` [ns].

        Raises:
            UsageError: `now` lies before the moment at which it was set going.
        """
        if self._since is None:
            return self._before
        if now < self._since:
            raise UsageError(f"time ran backwards: from {self._since} ns to {now} ns")
        return self._before + now - self._since

    def get_state(self) -> list[int | None]:
        """Time before the present run and when that began, as JSON values."""
        return [self._before, self._since]

    def set_state(self, state: Sequence[int | None]) -> None:
        """Take over what `get_state` returned."""
        before, self._since = state
        self._before = before or 0
