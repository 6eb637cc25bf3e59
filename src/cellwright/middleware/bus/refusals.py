"""What was refused: counted, and said once a second at most, so that a flood of bad commands drowns nothing."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from types import MappingProxyType

NANOSECONDS = 1_000_000_000
MOST_SOURCES = 256
"""So many sources are told apart; names come from outside, and must not eat the memory. The others share one."""
OTHERS = "others"
MOST_LINES = 20
"""So many lines at most are said in a second, whatever the sources call themselves; the rest is counted."""
LONGEST_LINE = 1000
"""Characters of a line at most: names and values in it come from outside."""

_LONGEST_SOURCE = 400


class Refusals:
    """Counts refused input by source, and reports it.

    The first refusal of a source is reported at once; those that follow within a second of simulation time are only
    counted, and their number is told with the next report. Of many sources at once some are only counted as well.

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
        self._said: deque[int] = deque(maxlen=MOST_LINES)  # when the newest lines were said [ns]

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
        source = _shortened(source, _LONGEST_SOURCE)
        if source not in self._counts and len(self._counts) >= MOST_SOURCES:
            source = OTHERS
        self._counts[source] += 1
        now = self._now()
        last = self._reported.get(source)
        if _is_recent(now, last) or (len(self._said) == MOST_LINES and _is_recent(now, self._said[0])):
            self._untold[source] += 1
            return
        self._said.append(now)
        untold = self._untold.pop(source, 0)
        self._reported[source] = now
        more = f" (and {untold} more since the last report)" if untold else ""
        self._report(f"{_shortened(f'refused {source}: {reason}', LONGEST_LINE)}{more}")

    def flush(self) -> None:
        """Report what was counted and not told yet, as at the end of a run; of many sources the first ones."""
        untold = list(self._untold.items())
        for source, count in untold[:MOST_LINES]:
            self._report(f"refused {source}: {count} more since the last report")
            self._reported[source] = self._now()
        if rest := untold[MOST_LINES:]:
            self._report(f"refused {sum(count for _, count in rest)} more, from {len(rest)} other sources")
        self._untold.clear()


def _is_recent(now: int, then: int | None) -> bool:
    """Whether less than a second has passed [ns]; not when time has begun anew since."""
    return then is not None and 0 <= now - then < NANOSECONDS


def _shortened(text: str, most: int) -> str:
    """A text that breaks no line, however long its names are and whatever is in them."""
    short = text if len(text) <= most else f"{text[: most - 3]}..."
    return short if short.isprintable() else "".join(each if each.isprintable() else "?" for each in short)
