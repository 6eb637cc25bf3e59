"""Transport protocol, and the in-process transport in which the client owns the clock."""

from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from cellwright.engine.device import Follower
from cellwright.engine.loop import StopCondition
from cellwright.middleware.bus import Direction, Node, PendingResponse
from cellwright.util.errors import RunEndedError

Callback = Callable[[Any], None]

CLOSED = "the client is closed"
"""Reason for the refusals to a program that uses its client after the end."""


class Transport(Protocol):
    """A connection to a cell: in the same process, over a socket, over ROS.

    Time is simulation time in nanoseconds. Messages are delivered only within `advance`. One that knows when time jumps
    also has a method `follow(follower)`: a client forgets then what it knows.
    """

    def now(self) -> int:
        """Simulation time [ns]."""

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Let time pass to `until` [ns] (None: without end), or until `finished()` after a tick.

        Calls the callbacks of subscriptions, in the order in which messages came.
        """

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Call `callback(message)` for each message on a topic; the returned function ends that.

        A passive callback only stores the message, so that time need not stop for it.
        """

    def publish(self, topic: str, message: Any) -> None:
        """Send a message to the cell."""

    def call(self, service: str, request: Any) -> Any:
        """Call a service and wait for its response."""

    def topics(self) -> dict[str, str]:
        """Return the types of the topics that the cell publishes, by name."""

    @property
    def knows_all_topics(self) -> bool:
        """True if `topics` lists all that there will be; in ROS others may appear."""

    def close(self) -> None:
        """Disconnect from the cell."""


def deliver_all(mail: deque[tuple[Callback, Any]]) -> None:
    """Call the callbacks of queued messages. Replies to them come with the next step: no exchange can stop time."""
    for _ in range(len(mail)):
        # The callback before has closed the client.
        if not mail:
            return
        callback, message = mail.popleft()
        callback(message)


class InProcess:
    """Transport to a cell in this process, one that has been reset: `advance` steps the simulation.

    The cell sees the client as the node `node`; when `stop` has ended the run, `advance` raises.
    """

    def __init__(self, cell: Node, *, node: str = "/client", stop: StopCondition | None = None) -> None:
        self.cell = cell
        self.node = node
        self.step: Callable[[], object] = cell.simulation.step
        """Advances time by a tick: the simulation's own step, or a paced one."""
        self.stop = stop or StopCondition()
        self._is_closed = False
        self._mail: deque[tuple[Callback, Any]] = deque()
        self._subscriptions: dict[Callable[[], None], None] = {}
        self._followers: list[Follower] = []
        cell.simulation.followers.append(self)

    knows_all_topics = True

    def now(self) -> int:
        """Simulation time [ns]."""
        return self.cell.simulation.clock.message_time()

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Step to `until` [ns], or until `finished()`; deliver messages after each step.

        Raises:
            RunEndedError: the deadline has come or the client was closed, and no more time passes.
        """
        self._refuse_if_closed()
        clock, step, mail, stop = self.cell.simulation.clock, self.step, self._mail, self.stop
        while until is None or clock.now + clock.offset < until:
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
        """Deliver a topic's messages while time passes; the returned function ends that."""
        self._refuse_if_closed()
        mail, is_active = self._mail, True

        def take(message: Any) -> None:
            if is_active:
                callback(message)

        def leave() -> None:
            nonlocal is_active
            # Messages in the queue are not delivered any more either.
            is_active = False
            subscription.cancel()
            self._subscriptions.pop(leave, None)

        # a latched message comes while subscribing: all that it needs is there by now
        subscription = self.cell.bus.subscribe(topic, lambda message: mail.append((take, message)), node=self.node)
        self._subscriptions[leave] = None
        return leave

    def publish(self, topic: str, message: Any) -> None:
        """Send a message; the cell acts on it before the next step."""
        self._refuse_if_closed()
        self.cell.bus.publish(topic, message, node=self.node)

    def call(self, service: str, request: Any) -> Any:
        """Call a service; the cell handles it between two steps. Time passes if its answer takes some.

        Raises:
            RunEndedError: the deadline has come before the answer.
        """
        self._refuse_if_closed()
        self.cell.simulation.settle_inbox()
        response = self.cell.bus.call(service, request, node=self.node)
        if not isinstance(response, PendingResponse):
            return response
        while response.response is None:
            if self.cell.simulation.now >= self.stop.deadline:
                raise RunEndedError(self.stop.reason)
            self.step()  # messages meanwhile are delivered when the program itself lets time pass
        return response.response

    def topics(self) -> dict[str, str]:
        """Return the types of the topics that the cell publishes, by name."""
        return {info.name: info.type for info in self.cell.bus.topics() if info.direction is Direction.OUT}

    def follow(self, follower: Follower) -> None:
        """Have a follower forget what it knows when time jumps, and remember it after `Cell.restore`."""
        self._followers.append(follower)

    def remember(self) -> object:
        """Return the messages that wait for delivery, and what the followers know."""
        return tuple(self._mail), [(each, each.remember()) for each in self._followers]

    def forget(self) -> None:
        """Forget the messages that wait for delivery, and what the followers know."""
        self._mail.clear()
        for each in self._followers:
            each.forget()

    def recall(self, memory: Any) -> None:
        """Restore what `remember` returned."""
        mail, followers = memory
        self._mail.clear()
        self._mail.extend(mail)
        for each, known in followers:
            each.recall(known)

    def close(self) -> None:
        """Cancel all subscriptions, and refuse further calls."""
        self._is_closed = True
        if self in self.cell.simulation.followers:
            self.cell.simulation.followers.remove(self)
        for leave in list(self._subscriptions):
            leave()
        self._subscriptions.clear()
        self._mail.clear()

    def _refuse_if_closed(self) -> None:
        if self._is_closed:
            raise RunEndedError(CLOSED)
