"""Clock of a bridge while simulation time stands.

The cell publishes its time when time passes. A node of ROS that starts meanwhile would wait for a time without end, and
one that stays would not hear of a reset. So the bridge asks for the time and repeats it. A latch would not do: nodes
subscribe to /clock without one, and a message that has no successor may be lost.
"""

from __future__ import annotations

from typing import Callable

from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.frames import Frame, FrameKind

TIME = "cellwright/time"
"""Service of the cell's server."""

PERIOD = 0.1
"""Wall time [s] between two repetitions."""


class QuietClock:
    """Repetition of the time that a cell has while it publishes none.

    Args:
        link: the connection to the cell.
        publish: publishes a time [ns].
        is_wanted: returns whether there are subscribers.
    """

    def __init__(self, link: LinkClient, publish: Callable[[int], None], is_wanted: Callable[[], bool]) -> None:
        self._link = link
        self._publish = publish
        self._is_wanted = is_wanted
        self._is_quiet = False
        link.loop.later(PERIOD, self._look)

    def note(self) -> None:
        """Note that the cell has published its time."""
        self._is_quiet = False

    def _look(self) -> None:
        if self._is_quiet and self._is_wanted():
            self._link.request(FrameKind.CALL, self._answered, name=TIME, payload=b"{}")
        self._is_quiet = True
        self._link.loop.later(PERIOD, self._look)

    def _answered(self, answer: Frame) -> None:
        if self._is_quiet and answer.kind is FrameKind.ANSWER:
            self._publish(int(answer.json()["time"]))
