"""Where commands from outside wait for the next border between two steps."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable


class Inbox:
    """Commands put in from any thread, carried out in order by the thread that steps the simulation.

    A command from any transport so lands at one well-defined tick: before the step that follows.
    """

    def __init__(self) -> None:
        self._waiting: deque[Callable[[], None]] = deque()  # append and popleft are atomic

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, command: Callable[[], None]) -> None:
        """Leave a command, from any thread."""
        self._waiting.append(command)

    def empty(self) -> int:
        """Carry out what was waiting when the call began; how many there were.

        What arrives meanwhile waits for the next border, so that a flood cannot stop time.
        """
        count = len(self._waiting)
        for _ in range(count):
            self._waiting.popleft()()
        return count
