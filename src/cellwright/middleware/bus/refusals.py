"""Refusals: a throttled count of refused input, by source."""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from types import MappingProxyType

NANOSECONDS = 1_000_000_000
MAX_SOURCES = 256  # counted separately; all others share one count, which bounds memory (names come from outside)
OTHERS = "others"
MAX_LINES = 20  # reported in a second, over all sources; the rest is counted
MAX_LINE_LENGTH = 1000  # characters; a line contains names and values from outside
MAX_KINDS = 5  # reported in a second of one source
_MAX_SOURCE_LENGTH = 400
_VALUES = re.compile(r"[-+]?[0-9][0-9.e+-]*|'[^']*'|\"[^\"]*\"|\[[^]]*\]")
"""Numbers, quoted names and lists in a reason, which change from message to message."""


class Refusals:
    """Counter of refused input by source, with throttled reports.

    It reports the first refusal of its kind at once: of a source, for a reason whose numbers and quoted names do not
    count. It only counts those of the same kind that follow within a second of simulation time; the next report about
    the source has their number. With many sources or kinds at once, some are only counted as well.

    Args:
        now: returns simulation time [ns].
        report: takes a line.
    """

    def __init__(self, now: Callable[[], int], report: Callable[[str], None]) -> None:
        self._now = now
        self._report = report
        self._counts: Counter[str] = Counter()
        self._recent: dict[tuple[str, str], int] = {}  # times of the newest lines [ns], by source and kind
        self._unreported: Counter[str] = Counter()
        self.newest_report: str | None = None
        """Addition of the newest refusal's report to its reason, which may be empty; None if it was only counted.
        A reader sets it back to None."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of refusals by source."""
        return MappingProxyType(self._counts)

    @property
    def total(self) -> int:
        """Total number of refusals."""
        return self._counts.total()

    def refuse(self, source: str, reason: str) -> None:
        """Count a refusal, and report it unless one of its kind was reported less than a second ago."""
        # Names come from outside: a client that invents one for each message must not fill memory or lines.
        source = _one_line(source, _MAX_SOURCE_LENGTH)
        if source not in self._counts and len(self._counts) >= MAX_SOURCES:
            source = OTHERS
        self._counts[source] += 1
        if not self._is_due(source, reason):
            self._unreported[source] += 1
            self.newest_report = None
            return
        unreported = self._unreported.pop(source, 0)
        self.newest_report = f" (and {unreported} more since the last report)" if unreported else ""
        self._report(f"{_one_line(f'refused {source}: {reason}', MAX_LINE_LENGTH)}{self.newest_report}")

    def warn(self, source: str, text: str) -> None:
        """Report a line about input that was accepted and is probably a mistake, at most one of a kind a second."""
        source = _one_line(source, _MAX_SOURCE_LENGTH)
        if self._is_due(source, text):
            self._report(_one_line(f"{source}: {text}", MAX_LINE_LENGTH))

    def flush(self) -> None:
        """Report what was counted but not reported, as at the end of a run; of many sources only the first ones."""
        unreported = list(self._unreported.items())
        for source, count in unreported[:MAX_LINES]:
            self._report(f"refused {source}: {count} more since the last report")
        if rest := unreported[MAX_LINES:]:
            self._report(f"refused {sum(count for _, count in rest)} more, from {len(rest)} other sources")
        self._unreported.clear()

    def _is_due(self, source: str, text: str) -> bool:
        """Return whether to report a line now, which is then noted: none of its kind was reported within a second."""
        now = self._now()
        self._recent = {each: then for each, then in self._recent.items() if _is_recent(now, then)}
        kind = source, _VALUES.sub("", text[:MAX_LINE_LENGTH])
        of_source = sum(each == source for each, _ in self._recent)
        if kind in self._recent or of_source >= MAX_KINDS or len(self._recent) >= MAX_LINES:
            return False
        self._recent[kind] = now
        return True


def _is_recent(now: int, then: int) -> bool:
    """True if less than a second has passed [ns], and time has not restarted since."""
    return 0 <= now - then < NANOSECONDS


def _one_line(text: str, max_length: int) -> str:
    """Return a text cut to `max_length` characters, without characters that break a line."""
    short = text if len(text) <= max_length else f"{text[: max_length - 3]}..."
    return short if short.isprintable() else "".join(each if each.isprintable() else "?" for each in short)
