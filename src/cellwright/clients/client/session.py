"""Client of a cell or of a robot's node: time, topics and services, blocking and in order.

The same program runs over every transport. In the same process the client owns the clock: `sleep` steps the
simulation, so a program gets the same result on any host.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from threading import get_ident
from typing import Any, Self

from cellwright.clients.client.in_process import Callback, InProcess, Transport
from cellwright.middleware.bus import Node
from cellwright.util.errors import UsageError

_LAST_PORT = 65535


def parse_address(address: str | tuple[str, int]) -> tuple[str, int]:
    """Return host and port of `HOST:PORT`; a pair is returned as it is.

    Raises:
        UsageError: it is no address.
    """
    if isinstance(address, str):
        host, _, digits = address.rpartition(":")
        port = int(digits) if re.fullmatch("[0-9]{1,5}", digits) else 0
    else:
        host, port = address
    if not host or not 0 < port <= _LAST_PORT:
        raise UsageError(f"{address}: give a host and a port, such as 127.0.0.1:11399")
    return host, port


class NodeClient:
    """Time, topics and services of a cell or of a robot's node.

    Callbacks run only inside `sleep` and `wait_until`; calling either from a callback is an error. The client belongs
    to the thread that made it, and refuses calls from others: two threads would take each other's answers.

    Example:
        >>> from cellwright import Cell, NodeClient, Trial
        >>> client = NodeClient.in_process(Cell(Trial("empty")))
        >>> seconds = []
        >>> cancel = client.subscribe("/clock", lambda message: seconds.append(message.clock.sec))
        >>> client.wait_until(lambda: 1 in seconds, timeout=2.0), client.time
        (True, 1.0)
        >>> cancel()
        >>> client.close()
    """

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self._waiting = False
        self._thread = get_ident()
        self._kept: list[Latest] = []
        if (follow := getattr(transport, "follow", None)) is not None:
            follow(self)

    def remember(self) -> object:
        """Return what it has received, for a snapshot of the cell; the messages themselves never change."""
        return [(each, each.remember()) for each in self._kept]

    def forget(self) -> None:
        """Forget what it has received: time has jumped, as in `Cell.reset`. Subscriptions stay."""
        for each in self._kept:
            each.recall(None)

    def recall(self, memory: Any) -> None:
        """Know again what `remember` returned."""
        for each, known in memory:
            each.recall(known)

    def adopt(self) -> None:
        """Make the calling thread the owner, once the previous owner has finished with the client."""
        self._thread = get_ident()

    def _refuse_strangers(self) -> None:
        if get_ident() != self._thread:
            raise UsageError("a client works in the thread that created it; call it there, and pass the results on")

    @classmethod
    def in_process(cls, cell: Node, *, node: str = "/client") -> Self:
        """Connect to a `Cell` or a `RobotNode` in this process: its time passes only in `sleep` and `wait_until`.

        The cell sees the client as the node `node`.
        """
        return cls(InProcess(cell, node=node))

    @classmethod
    def connect(cls, address: str | tuple[str, int], *, node: str = "/client") -> Self:
        """Connect to a cell or a robot that another process serves (`cellwright serve`, `cellwright teleop`).

        Args:
            address: `"127.0.0.1:11399"` as the other process prints it, or a pair of host and port.
            node: name under which the cell sees the client.

        Raises:
            UsageError: it is no address, or no server answers there.
        """
        from cellwright.clients.client.socket_transport import SocketTransport

        return cls(SocketTransport(parse_address(address), node=node))

    @property
    def time(self) -> float:
        """Simulation time [s]; a UsageError in another thread."""
        self._refuse_strangers()
        return self.transport.now() / 1e9

    def sleep(self, duration: float) -> None:
        """Let `duration` seconds of simulation time pass.

        Raises:
            UsageError: called from a callback or another thread, or with a negative or non-finite duration.
            RunEndedError: the run is over.
        """
        self._refuse_nesting()
        if not 0.0 <= duration < float("inf"):
            raise UsageError(f"cannot sleep for {duration} s")
        self._advance(self.transport.now() + round(duration * 1e9), None)

    def wait_until(self, condition: Callable[[], bool], timeout: float | None = None) -> bool:
        """Let time pass until `condition()` is true.

        Args:
            condition: called at once, and then after each tick.
            timeout: longest wait in simulation time [s]; None or infinity for no limit.

        Returns:
            The last value of the condition: False after a timeout.

        Raises:
            UsageError: called from a callback or another thread, or with a timeout that is not a number.
            RunEndedError: the run is over.
        """
        self._refuse_nesting()
        if condition():
            return True
        if timeout is None or timeout == float("inf"):
            until = None
        elif math.isfinite(timeout):
            until = self.transport.now() + round(timeout * 1e9)
        else:
            raise UsageError(f"cannot wait for {timeout} s")
        self._advance(until, condition)
        return condition()

    def rate(self, frequency: float) -> Rate:
        """Return a rate of `frequency` [Hz]: `rate.sleep()` waits for the next beat."""
        return Rate(self, frequency)

    def _advance(self, until: int | None, finished: Callable[[], bool] | None) -> None:
        self._waiting = True
        try:
            self.transport.advance(until, finished)
        finally:
            self._waiting = False

    def _refuse_nesting(self) -> None:
        self._refuse_strangers()
        if self._waiting:
            raise UsageError("sleep and wait_until cannot be called from a callback; return from it first")

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Call `callback(message)` for each message on a topic.

        Args:
            topic: name of the topic.
            callback: takes each message, inside `sleep` and `wait_until`.
            passive: the callback only stores the message or a part of it, and does not read the time. In lockstep
                time need not stop for it, which is faster, and changes nothing.

        Returns:
            A function that ends the subscription.
        """
        self._refuse_strangers()
        return self.transport.subscribe(topic, callback, passive=passive)

    def publish(self, topic: str, message: Any) -> None:
        """Send a message to the cell; it takes effect before the next step.

        Args:
            topic: a topic that the cell subscribes to.
            message: a message of the topic's type, from `cellwright.middleware.messages`.

        Raises:
            UnknownNameError: the cell subscribes to no such topic.
            RejectedCommandError: the message is of another type, or the cell refuses its command.
        """
        self._refuse_strangers()
        self.transport.publish(topic, message)

    def call(self, service: str, request: Any) -> Any:
        """Call a service and wait for its response.

        Args:
            service: name of the service.
            request: a request of the service's type, from `cellwright.middleware.messages`.

        Returns:
            The response.

        Raises:
            UnknownNameError: there is no such service.
            RejectedCommandError: the request has another type, or was refused.
            ServiceFailedError: the service gave no answer.
        """
        self._refuse_strangers()
        return self.transport.call(service, request)

    def latest(self, topic: str) -> Latest:
        """Subscribe to a topic, and keep its newest message."""
        return Latest(self, topic)

    def close(self) -> None:
        """Disconnect from the cell, from any thread; no more time passes then. A second call has no effect."""
        self.transport.close()


class Rate:
    """A rate as in ROS: a missed beat is made up for, unless two have gone by.

    Args:
        session: the client whose simulation time counts.
        frequency: beats per second [Hz].

    Raises:
        UsageError: the frequency is not above 0, or not finite.

    Example:
        >>> from cellwright import Cell, NodeClient, Trial
        >>> client = NodeClient.in_process(Cell(Trial("empty")))
        >>> rate = client.rate(10.0)
        >>> client.sleep(0.03)  # work between two beats
        >>> rate.sleep()
        >>> client.time
        0.1
    """

    def __init__(self, session: NodeClient, frequency: float) -> None:
        if not 0.0 < frequency < float("inf"):
            raise UsageError(f"a rate must be above 0 Hz (got {frequency})")
        self._session = session
        self._period = 1.0 / frequency
        self._last = session.time

    def sleep(self) -> None:
        """Wait for the next beat; return at once if it has gone by."""
        now = self._session.time
        # As rospy does: time may have gone back, in a reset.
        self._last = min(self._last, now)
        self._session.sleep(max(0.0, self._last + self._period - now))
        self._last += self._period
        if now - self._last > 2 * self._period:
            self._last = now


class Latest:
    """The newest message of a topic.

    Attributes:
        topic: name of the topic.
        message: the newest message; None before the first, and after a reset.
        count: number of messages so far, since the latest reset.

    Example:
        >>> from cellwright import Cell, NodeClient, Trial
        >>> client = NodeClient.in_process(Cell(Trial("empty")))
        >>> clock = client.latest("/clock")
        >>> client.sleep(0.01)
        >>> clock.count, clock.message.clock.nanosec
        (5, 10000000)
    """

    def __init__(self, session: NodeClient, topic: str) -> None:
        self._session = session
        self.topic = topic
        self.message: Any = None
        self.count = 0
        self._unsubscribe: Callable[[], None] | None = None
        session._kept.append(self)
        self.listen()

    def listen(self) -> None:
        """Take messages again after `cancel`."""
        if self._unsubscribe is None:
            self._unsubscribe = self._subscribe()

    def _subscribe(self) -> Callable[[], None]:
        return self._session.subscribe(self.topic, self._take, passive=True)

    def cancel(self) -> None:
        """Take no more messages; the newest one stays."""
        if self._unsubscribe is not None:
            self._unsubscribe()
            self._unsubscribe = None

    def _take(self, message: Any) -> None:
        self.message = message
        self.count += 1

    def remember(self) -> Any:
        """Return what has come, for a snapshot."""
        return self.message, self.count

    def recall(self, memory: Any) -> None:
        """Know again what `remember` returned; None for nothing."""
        self.message, self.count = memory or (None, 0)

    def wait(self, timeout: float | None = None) -> Any:
        """Return the newest message; wait for the first one, None if it does not come within `timeout` [s]."""
        self._session.wait_until(lambda: self.message is not None, timeout)
        return self.message

    def wait_for_next(self, timeout: float | None = None) -> Any:
        """Wait for the next message; None if none comes within `timeout` [s]."""
        seen = self.count
        is_next = self._session.wait_until(lambda: self.message is not None and self.count != seen, timeout)
        return self.message if is_next else None
