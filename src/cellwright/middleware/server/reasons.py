"""Why something did not go well, however often it happened: the first reason, and a number."""

from __future__ import annotations


class Reasons:
    """Keeps the first of many reasons, and counts the others. It is false while there is none."""

    def __init__(self) -> None:
        self._first = ""
        self._count = 0

    def __bool__(self) -> bool:
        return self._count > 0

    def add(self, reason: str) -> None:
        """Take note of one."""
        self._first = self._first or reason
        self._count += 1

    def take(self) -> str:
        """What there was, in a line; from then on it counts anew."""
        more = f" (and {self._count - 1} more since the last report)" if self._count > 1 else ""
        line, self._first, self._count = f"{self._first}{more}", "", 0
        return line
