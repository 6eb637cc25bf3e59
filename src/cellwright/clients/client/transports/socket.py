"""The way to a cell in another process: over a socket, blocking, one thread.

Over a cell in lockstep time passes only while this client waits, and its program gets the same result as in the cell's
own process. Otherwise time passes by itself, and is known from `/clock`; where nobody publishes that, as before a robot
in real time, it is this machine's own.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

from cellwright.clients.client.transports.connection import Connection
from cellwright.clients.client.transports.transport import Callback
from cellwright.middleware.messages import (
    Message,
    checked,
    from_cdr,
    from_ros1,
    message_type,
    service_type,
    to_cdr,
    to_ros1,
    type_of,
)
from cellwright.middleware.wire.frames import QUIET, Frame, Kind, advance, read_time
from cellwright.util.errors import CellwrightError, RunEndedError

_FOR_EVER = (1 << 63) - 1
_REQUEST = "_Request"
_LOOK = 0.02  # [s] between two looks at a condition where no clock ticks

Deliver = Callable[[bytes], None]


class SocketTransport:
    """A client's way to a served cell.

    Args:
        address: host and port at which the cell is served.
        node: the client's node name, as the cell sees it.
        encoding: the form in which messages travel, `cdr` or `ros1`.

    Raises:
        UsageError: nobody answers there.
    """

    def __init__(self, address: tuple[str, int], *, node: str = "/client", encoding: str = "cdr") -> None:
        self.node = node
        self._read, self._write = (from_ros1, to_ros1) if encoding == "ros1" else (from_cdr, to_cdr)
        self._deliveries: dict[int, Deliver] = {}
        self._mail: deque[tuple[Deliver, bytes]] = deque()
        self._connection = Connection(address, node=node, encoding=encoding, on_frame=self._take)
        welcome = self._connection.welcome
        self.welcome = welcome
        """What the cell says of itself."""
        self._types = {each["name"]: str(each["type"]) for each in welcome["topics"]}
        self._services = {each["name"]: str(each["type"]) for each in welcome["services"]}
        self._now = int(welcome["time"])
        self._lockstep = bool(welcome["lockstep"])
        self._clock = 0
        self._has_clock = any(each["name"] == "/clock" and each["direction"] == "out" for each in welcome["topics"])
        self._ahead = self._now - time.perf_counter_ns()
        if not self._lockstep and self._has_clock:
            self._clock = self._connection.number()
            self._connection.ask(Frame(Kind.SUBSCRIBE, self._clock, "/clock"))

    knows_all_topics = True

    def now(self) -> int:
        """Simulation time [ns]; where nobody tells it, the time since the connection was made counts on."""
        if not self._lockstep and not self._has_clock:
            self._now = time.perf_counter_ns() + self._ahead
        elif not self._lockstep:
            try:
                while self._connection.listen(0.0):
                    pass
            except RunEndedError:
                pass  # time stands still then; whoever wants it to pass is told
        return self._now

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Let time go on to `until` [ns], or until `finished()`; deliver what comes after each tick."""
        let_pass = self._wait_for_time if self._has_clock else self._wait_by_the_wall
        if self._lockstep:
            let_pass = self._ask_for_time
        while until is None or self._now < until:
            let_pass(_FOR_EVER if until is None else until, finished is not None)
            self._deliver()
            if finished is not None and finished():
                return

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Have a topic's messages delivered while time passes."""
        number = self._connection.number()
        message_class: type[Message] | None = None
        wanted = True

        def deliver(data: bytes) -> None:
            nonlocal message_class
            if wanted:
                message_class = message_class or message_type(self._types[topic])
                callback(self._read(data, message_class))

        def leave() -> None:
            nonlocal wanted
            if wanted:
                wanted = False  # also what lies in the mail already is not delivered any more
                if self._deliveries.pop(number, None) is not None:  # none is left of a client that was closed
                    self._connection.say(Frame(Kind.UNSUBSCRIBE, number))

        self._deliveries[number] = deliver  # what is latched comes before the answer
        try:
            self._connection.ask(Frame(Kind.SUBSCRIBE, number, topic, QUIET if passive else ""))
        except CellwrightError:
            del self._deliveries[number]
            raise
        return leave

    def publish(self, topic: str, message: Any) -> None:
        """Send a message; the cell acts on it where time stands."""
        message = checked(message)
        frame = Frame(
            Kind.PUBLISH, self._connection.number(), topic, type_of(type(message)), payload=self._write(message)
        )
        self._connection.ask(frame)

    def call(self, service: str, request: Any) -> Any:
        """Call a service; it is carried out at the border where time stands. Time passes if its answer takes some."""
        request = checked(request)
        name = type_of(type(request)).removesuffix(_REQUEST)
        frame = Frame(Kind.CALL, self._connection.number(), service, name, payload=self._write(request))
        answer = self._connection.ask(frame)
        if answer.kind is Kind.DONE:
            answer = self._wait_for(frame.number)
        return self._read(answer.payload, service_type(self._services[service]).response)

    def ask_server(self, service: str) -> dict[str, Any]:
        """Call a service of the server itself, which answers with a JSON object."""
        return self._connection.ask(Frame(Kind.CALL, self._connection.number(), service, payload=b"{}")).json()

    def topics(self) -> dict[str, str]:
        """Types of the topics that the cell publishes, by name."""
        return {each["name"]: str(each["type"]) for each in self.welcome["topics"] if each["direction"] == "out"}

    def close(self) -> None:
        """Let go of the cell."""
        self._connection.close()
        self._deliveries.clear()
        self._mail.clear()

    # ---------------------------------------------------------------- time

    def _ask_for_time(self, until: int, each_tick: bool) -> None:  # noqa: FBT001
        self._now = read_time(self._connection.ask(advance(self._connection.number(), until, each_tick=each_tick)))

    def _wait_for(self, number: int) -> Frame:
        """In lockstep: let time pass, tick by tick, until a call is answered."""
        self._connection.promise(number)
        while (answer := self._connection.promised(number)) is None:
            self._ask_for_time(_FOR_EVER, each_tick=True)
        return answer

    def _wait_for_time(self, _until: int, _each_tick: bool) -> None:  # noqa: FBT001
        before = self._now
        while self._now == before and not self._mail:
            self._connection.listen(None)

    def _wait_by_the_wall(self, until: int, each_tick: bool) -> None:  # noqa: FBT001
        while not self._mail and (left := until - self.now()) > 0:
            self._connection.listen(min(left / 1e9, _LOOK))
            if each_tick:
                break
        self.now()

    def _take(self, frame: Frame) -> None:
        """Take a message as it comes; it is delivered when time passes."""
        deliver = self._deliveries.get(frame.number)
        if deliver is not None:
            self._mail.append((deliver, frame.payload))
        elif frame.number == self._clock:
            stamp = self._read(frame.payload, message_type("rosgraph_msgs/Clock")).clock  # type: ignore[attr-defined]
            self._now = stamp.sec * 1_000_000_000 + stamp.nanosec

    def _deliver(self) -> None:
        # What callbacks cause comes with the next step, so that a conversation cannot stop time.
        for _ in range(len(self._mail)):
            if not self._mail:  # the callback before has closed the client
                return
            deliver, data = self._mail.popleft()
            deliver(data)
