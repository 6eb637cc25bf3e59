"""What there is to tell whoever drives: a line at a time, no more than one a second, and each for a while."""

from __future__ import annotations

LASTS = 6.0
"""So long [s] a line stands."""
GAP = 1.0
"""Least time between two lines of the same kind [s]."""


class Notes:
    """The newest line."""

    def __init__(self) -> None:
        self.text = ""
        self.is_bad = False
        self._until = 0.0
        self._told: dict[str, float] = {}

    def tell(self, text: str, now: float, *, kind: str = "", is_bad: bool = False) -> None:
        """Show a line from `now` [s] on; one of a kind that was told less than a second ago is dropped."""
        if kind and now - self._told.get(kind, float("-inf")) < GAP:
            return
        if kind:
            self._told[kind] = now
        self.text, self.is_bad, self._until = text, is_bad, now + LASTS

    def at(self, now: float) -> str:
        """The line that stands at `now` [s]; empty when there is none."""
        return self.text if now < self._until else ""
