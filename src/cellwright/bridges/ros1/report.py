"""Lines for people, on stderr; the cell's process passes them on."""

from __future__ import annotations

import sys
import time
from typing import Dict

_SECOND = 1.0


def report(line: str) -> None:
    """Say something in one line. When nobody can hear it any more, that is no error."""
    try:
        print(line.replace("\n", " "), file=sys.stderr, flush=True)
    except (OSError, ValueError):
        pass


class Tally:
    """Counts what happens over and over, and says how often it did at most once a second.

    Args:
        text: the line, with `{count}` for how often it happened since the last one.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._counts: Dict[str, int] = {}
        self._said: Dict[str, float] = {}

    def count(self, subject: str) -> None:
        """Count one more for a subject, the `{subject}` of the line."""
        self._counts[subject] = self._counts.get(subject, 0) + 1
        self.flush(subject)

    def flush(self, subject: str, *, now: bool = False) -> None:
        """Say what was counted for a subject, unless the last line is younger than a second and it need not be now."""
        count, clock = self._counts.get(subject, 0), time.monotonic()
        if count and (now or clock - self._said.get(subject, -_SECOND) >= _SECOND):
            self._said[subject] = clock
            self._counts[subject] = 0
            report(self._text.format(subject=subject, count=count))
