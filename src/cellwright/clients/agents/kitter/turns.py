"""Programs that work side by side, each with a client of its own, on one connection to a cell.

Each runs in a thread, but only one at a time, until it lets time pass itself. Then the next one runs, in their order.
Time passes once all of them wait. So programs need no locks, and a run stays repeatable.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from threading import Semaphore, Thread
from typing import Any, TypeVar

from cellwright.clients.client import Client
from cellwright.clients.client.in_process import Callback, Transport
from cellwright.util.errors import RunEndedError

Result = TypeVar("Result")


class Turns:
    """Clients of one connection, and programs that take turns with them.

    Args:
        transport: the connection.
        count: number of clients.

    Attributes:
        clients: the clients. Each works in its own program, or in none.
    """

    def __init__(self, transport: Transport, count: int) -> None:
        self._transport = transport
        self._seats = [_Seat(transport) for _ in range(count)]
        self.clients = [Client(seat) for seat in self._seats]
        for seat, client in zip(self._seats, self.clients, strict=True):
            seat.client = client

    def run(self, programs: Sequence[Callable[[], Result]]) -> list[Result]:
        """Run a program for each client until all have ended, and return their results.

        Raises:
            BaseException: the first error of a program, or of the connection. The other programs end with it.
        """
        results: dict[int, Result] = {}

        def work(index: int) -> Callable[[], None]:
            def program() -> None:
                results[index] = programs[index]()

            return program

        for index, seat in enumerate(self._seats):
            seat.begin(work(index))
        due = self._seats
        try:
            while True:
                for seat in due:
                    seat.resume()
                working = [seat for seat in self._seats if not seat.has_ended]
                if not working:
                    return [results[index] for index in range(len(programs))]
                self._let_time_pass(working)
                due = [seat for seat in working if seat.is_due()]
        except BaseException as error:
            for seat in self._seats:
                seat.end(error)
            raise

    def close(self) -> None:
        """End all subscriptions of the clients."""
        for client in self.clients:
            client.adopt()
            client.close()

    def _let_time_pass(self, working: Sequence[_Seat]) -> None:
        """Let time pass until one of the programs may go on. Messages are delivered here, as are conditions."""
        for seat in self._seats:
            seat.client.adopt()
        times = [seat.until for seat in working if seat.until is not None]
        conditions = [seat.finished for seat in working if seat.finished is not None]
        finished = (lambda: any(each() for each in conditions)) if conditions else None
        self._transport.advance(min(times, default=None), finished)


class _Seat:
    """The connection as one program has it: time passes only when all programs wait."""

    client: Client

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._may_go, self._waits = Semaphore(0), Semaphore(0)
        self._error: BaseException | None = None
        self._stop: BaseException | None = None
        self._subscriptions: dict[Callable[[], None], None] = {}
        self.until: int | None = 0
        """Time [ns] for which the program waits; None for any."""
        self.finished: Callable[[], bool] | None = None
        """Condition for which it waits."""
        self.has_ended = True

    def begin(self, program: Callable[[], None]) -> None:
        """Make the thread of a program; it waits for `resume`."""
        self._error, self.has_ended = None, False

        def work() -> None:
            self._may_go.acquire()
            try:
                self._go_on()
                program()
            except BaseException as error:  # raised again where the programs were begun
                self._error = error
            self.has_ended = True
            self._waits.release()

        Thread(target=work, daemon=True).start()

    def resume(self) -> None:
        """Let the program work until it waits or has ended; raises its error."""
        self._may_go.release()
        try:
            self._waits.acquire()
        except BaseException as error:  # Ctrl-C
            self._stop = error
            self._waits.acquire()
            raise
        if self._error is not None:
            raise self._error

    def end(self, error: BaseException) -> None:
        """Have the program end with an error of another one, or of the connection."""
        self._stop = error
        while not self.has_ended:
            self._may_go.release()
            self._waits.acquire()

    def is_due(self) -> bool:
        """Return whether that for which the program waits has come."""
        is_time = self.until is not None and self._transport.now() >= self.until
        return is_time or (self.finished is not None and self.finished())

    def _go_on(self) -> None:
        self.client.adopt()
        if self._stop is not None:
            raise RunEndedError(str(self._stop)) from self._stop

    # as a transport

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Let the other programs work, and time pass to `until` [ns], or until `finished()` after a tick."""
        if until is not None and until <= self._transport.now():
            return
        self.until, self.finished = until, finished
        self._waits.release()
        self._may_go.acquire()
        self._go_on()

    def now(self) -> int:
        """Simulation time [ns]."""
        return self._transport.now()

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Call `callback(message)` for each message on a topic; the returned function ends that."""
        end = self._transport.subscribe(topic, callback, passive=passive)

        def leave() -> None:
            self._subscriptions.pop(leave, None)
            end()

        self._subscriptions[leave] = None
        return leave

    def publish(self, topic: str, message: Any) -> None:
        """Send a message to the cell."""
        self._transport.publish(topic, message)

    def call(self, service: str, request: Any) -> Any:
        """Call a service and wait for its response."""
        return self._transport.call(service, request)

    def topics(self) -> dict[str, str]:
        """Return the types of the topics that the cell publishes, by name."""
        return self._transport.topics()

    @property
    def knows_all_topics(self) -> bool:
        """True if `topics` lists all that there will be."""
        return self._transport.knows_all_topics

    def close(self) -> None:
        """End the subscriptions of the program; the connection stays."""
        for leave in list(self._subscriptions):
            with suppress(RunEndedError):
                leave()
