"""What happens over and over: counted, and said once a second at most."""

from __future__ import annotations

from cellwright.middleware.ros1.bridge.loop import Loop
from cellwright.middleware.ros1.bridge.report import report

PERIOD = 1.0
"""Time between two lines about the same [s]."""


class Tally:
    """Counts by subject; the first is said at once, those that follow within a second with the next line.

    Args:
        loop: its thread keeps the books.
        text: the line, with `{subject}`, and `{count}` for how often it happened since the last one.
    """

    def __init__(self, loop: Loop, text: str) -> None:
        self._loop = loop
        self._text = text
        self._counts: dict[str, int] = {}

    def count(self, subject: str) -> None:
        """Count one more for a subject; from any thread."""
        self._loop.call(self._count, subject)

    def _count(self, subject: str) -> None:
        is_known = subject in self._counts
        self._counts[subject] = self._counts.get(subject, 0) + 1
        if not is_known:
            self._say(subject)

    def _say(self, subject: str) -> None:
        """Say what was counted, and look again in a second; a subject that has come to rest is forgotten."""
        count = self._counts[subject]
        if count == 0:
            del self._counts[subject]
            return
        self._counts[subject] = 0
        report(self._text.format(subject=subject, count=count))
        self._loop.later(PERIOD, lambda: self._say(subject))
