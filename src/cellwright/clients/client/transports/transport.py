"""What a client needs of the way to its cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

Callback = Callable[[Any], None]


class Transport(Protocol):
    """A way to a cell: in the same process, over a socket, over ROS.

    Time is simulation time in nanoseconds. Nothing is delivered but within `advance`.
    """

    def now(self) -> int:
        """Simulation time [ns]."""

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Let time go on to `until` [ns] (None: without end), or until `finished()` after a tick.

        Callbacks of subscriptions are called from here, in the order in which messages came.
        """

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Have `callback(message)` called for each message on a topic; the returned function ends it.

        A passive callback takes note of the message and does nothing else, so that time need not stand for it.
        """

    def publish(self, topic: str, message: Any) -> None:
        """Send a message to the cell."""

    def call(self, service: str, request: Any) -> Any:
        """Call a service and wait for its response."""

    def topics(self) -> dict[str, str]:
        """Types of the topics that the cell publishes, by name."""

    @property
    def knows_all_topics(self) -> bool:
        """Whether these are all that there will be; in ROS others may come."""

    def close(self) -> None:
        """Let go of the cell."""
