"""What was refused: counted, and said once a second at most, so that a flood of bad commands drowns nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from types import MappingProxyType

NANOSECONDS = 1_000_000_000
MOST_SOURCES = 256
"""So many sources are told apart; names come from outside, and must not eat the memory. The others share one."""
OTHERS = "others"


class Refusals:
    """Counts refused input by source, and reports it.

    The first refusal of a source is reported at once; those that follow within a second of simulation time are only
    counted, and their number is told with the next report.

    Args:
        now: simulation time [ns].
        report: takes the line to be logged.
    """

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now = now
        self._report = report
        self._counts: Counter[str] = Counter()
        self._reported: dict[str, int] = {}
        self._untold: Counter[str] = Counter()

    @property
    def counts(self) -> Mapping[str, int]:
        """How much was refused, by source."""
        return MappingProxyType(self._counts)

    @property
    def total(self) -> int:
        """How much was refused in all."""
        return self._counts.total()

    def refuse(self, source: str, reason: str) -> None:
        """Count a refusal, and report it unless one from the same source was reported less than a second ago."""
        if source not in self._counts and len(self._counts) >= MOST_SOURCES:
            source = OTHERS
        self._counts[source] += 1
        now = self._now()
        last = self._reported.get(source)
        if last is not None and 0 <= now - last < NANOSECONDS:
            self._untold[source] += 1
            return
        untold = self._untold.pop(source, 0)
        self._reported[source] = now
        more = f" (and {untold} more since the last report)" if untold else ""
        self._report(f"refused {source}: {reason}{more}")

    def flush(self) -> None:
        """Report what was counted and not told yet, as at the end of a run."""
        for source, untold in self._untold.items():
            self._report(f"refused {source}: {untold} more since the last report")
            self._reported[source] = self._now()
        self._untold.clear()
