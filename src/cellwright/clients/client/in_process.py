"""Transport protocol, and the in-process transport in which the client owns the clock."""

from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from cellwright.engine.loop import StopCondition
from cellwright.middleware.bus import Direction, Later, Served
from cellwright.util.errors import RunEndedError

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


CLOSED = "the client is closed"
"""Why nothing can be asked for any more by a program that has kept its client past the end."""


def deliver_all(mail: deque[tuple[Callback, Any]]) -> None:
    """Call callbacks with what came. What they cause comes with the next step: a conversation cannot stop time."""
    for _ in range(len(mail)):
        if not mail:  # the callback before has closed the client
            return
        callback, message = mail.popleft()
        callback(message)


class InProcess:
    """A client's way to a cell in this process, one that has been reset: `advance` steps the simulation.

    The cell sees the client as the node `node`; when the run is over by `stop`, `advance` raises.
    """

    def __init__(self, cell: Served, *, node: str = "/client", stop: StopCondition | None = None) -> None:
        self.cell = cell
        self.node = node
        self.step: Callable[[], object] = cell.simulation.step
        """What lets a tick pass: the simulation's own step, or a paced one."""
        self.stop = stop or StopCondition()
        self._is_closed = False
        self._mail: deque[tuple[Callback, Any]] = deque()
        self._leave: dict[Callable[[], None], None] = {}

    knows_all_topics = True

    def now(self) -> int:
        """Simulation time [ns]."""
        return self.cell.simulation.now

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Step to `until` [ns], or until `finished()`; deliver what comes after each step.

        Raises:
            RunEndedError: the deadline has come or the client was closed, and no more time passes.
        """
        self._refuse_if_closed()
        clock, step, mail, stop = self.cell.simulation.clock, self.step, self._mail, self.stop
        while until is None or clock.now < until:
            if clock.now >= stop.deadline:
                raise RunEndedError(stop.reason)
            if self._is_closed:
                raise RunEndedError(CLOSED)
            step()
            if mail:
                deliver_all(mail)
            if finished is not None and finished():
                return

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:  # noqa: ARG002
        """Have a topic's messages delivered while time passes."""
        self._refuse_if_closed()
        mail, wanted = self._mail, True

        def take(message: Any) -> None:
            if wanted:
                callback(message)

        def leave() -> None:
            nonlocal wanted
            wanted = False  # also what lies in the mail already is not delivered any more
            subscription.cancel()
            self._leave.pop(leave, None)

        # a latched message comes while subscribing: all that it needs is there by now
        subscription = self.cell.bus.subscribe(topic, lambda message: mail.append((take, message)), node=self.node)
        self._leave[leave] = None
        return leave

    def publish(self, topic: str, message: Any) -> None:
        """Send a message; the cell acts on it before the next step."""
        self._refuse_if_closed()
        self.cell.bus.publish(topic, message, node=self.node)

    def call(self, service: str, request: Any) -> Any:
        """Call a service; it is carried out at the border where time stands. Time passes if its answer takes some.

        Raises:
            RunEndedError: the deadline has come before the answer.
        """
        self._refuse_if_closed()
        self.cell.simulation.settle_inbox()
        response = self.cell.bus.call(service, request, node=self.node)
        if not isinstance(response, Later):
            return response
        while response.response is None:
            if self.cell.simulation.now >= self.stop.deadline:
                raise RunEndedError(self.stop.reason)
            self.step()  # what is heard meanwhile is delivered when the program lets time pass by itself
        return response.response

    def topics(self) -> dict[str, str]:
        """Types of the topics that the cell publishes, by name."""
        return {info.name: info.type for info in self.cell.bus.topics() if info.direction is Direction.OUT}

    def close(self) -> None:
        """Leave every topic, and ask for nothing any more."""
        self._is_closed = True
        for leave in list(self._leave):
            leave()
        self._leave.clear()
        self._mail.clear()

    def _refuse_if_closed(self) -> None:
        if self._is_closed:
            raise RunEndedError(CLOSED)
