"""Socket transport: the connection to a served cell or robot, and the client's time over it.

Over a cell in lockstep time passes only while this client waits, and its program gets the same result as in the cell's
own process. Otherwise time passes independently, and is read from `/clock`. Where there is no `/clock`, as at a robot
in real time, it is this machine's own.
"""

import itertools
import json
import select
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from cellwright.clients.client.in_process import Callback, deliver_all
from cellwright.engine.device import Follower
from cellwright.middleware.messages import TYPES, Message, TypeSet, type_of
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.middleware.wire.frames import (
    MAX_CLIENT_FRAME_BYTES,
    QUIET,
    Decoder,
    Frame,
    FrameError,
    FrameKind,
    advance,
    hello,
    read_time,
)
from cellwright.util import errors
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError, UsageError, printable

_RECEIVE_SIZE = 1 << 18
_SMALL = 1 << 14  # bytes that the system takes at once, for a cell that reads now and then
_SELECT_TIMEOUT = 0.5  # [s]; on Windows a Ctrl-C is not heard while a process waits for a socket
_END_OF_TIME = (1 << 63) - 1
_REQUEST_SUFFIX = "_Request"
_POLL_INTERVAL = 0.02  # [s] between two looks at a condition where no clock ticks


class SocketConnection:
    """Connection to a server as the node `node`: sends requests, and hands every frame that is no answer to `on_frame`.

    Messages have the encoding `encoding`, one of `TypeSet.encodings`. The server has `timeout` [s] to accept the
    connection and to greet; `key` is the server's key for its own page.

    Raises:
        UsageError: no server answers there, or it is no cell.
    """

    def __init__(
        self,
        address: tuple[str, int],
        *,
        node: str,
        encoding: str,
        on_frame: Callable[[Frame], None],
        timeout: float = 10.0,
        key: str = "",
    ) -> None:
        place = f"{address[0]}:{address[1]}"
        try:
            self._socket = socket.create_connection(address, timeout=timeout)
        except (OSError, OverflowError) as error:
            raise UsageError(f"no server answers at {place}: {getattr(error, 'strerror', None) or error}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(True)
        self._decoder = Decoder()
        self._numbers = itertools.cycle(range(1, 1 << 32))
        self._on_frame = on_frame
        self._awaited = 0
        self._answers: list[Frame] = []
        self._expected: dict[int, list[Frame]] = {}
        self._end: str | None = None
        try:
            self._send(hello(node, encoding, key).encode())
            self.welcome = self._await_answer(0, timeout).json()
            """The server's description of itself, its topics and its services."""
        except (RunEndedError, FrameError) as error:
            self.close()
            raise UsageError(f"no server answers at {place}: {error}") from None

    def number(self) -> int:
        """Return a free number for a request or a subscription."""
        return next(self._numbers)

    def ask(self, frame: Frame) -> Frame:
        """Send a frame and wait for its answer.

        Raises:
            CellwrightError: it was refused; of the class that says why.
            RunEndedError: no answer or no time can come any more.
        """
        self.send(frame)
        return check_answer(self._await_answer(frame.number))

    def expect_reply(self, number: int) -> list[Frame]:
        """Return a list for a second answer to a request that has been answered already; empty until it has come."""
        replies = [frame for frame in self._answers[1:] if frame.number == number]  # right behind the first one
        if not replies:
            self._expected[number] = replies
        return replies

    def send(self, frame: Frame) -> None:
        """Send a frame that has no answer, or whose answer is ignored; errors as of `ask`."""
        if self._end is not None:
            raise RunEndedError(self._end)
        try:
            data = frame.encode(MAX_CLIENT_FRAME_BYTES)
        except FrameError as error:
            raise UsageError(str(error)) from None
        self._send(data)

    def listen(self, timeout: float | None) -> bool:
        """Read what has come, and wait for it at most `timeout` [s] (None: no limit); True if something came.

        Raises:
            RunEndedError: nothing can come any more.
        """
        if self._end is not None:
            raise RunEndedError(self._end)
        try:
            while not select.select([self._socket], (), (), _SELECT_TIMEOUT if timeout is None else timeout)[0]:
                if timeout is not None:
                    return False
        except (OSError, ValueError):  # another thread has closed the connection meanwhile
            if self._end is None:
                raise
            raise RunEndedError(self._end) from None
        self._read()
        return True

    def close(self) -> None:
        """Close the connection."""
        self._end = self._end or "the connection was closed"
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # unblocks a thread that listens
        self._socket.close()

    def _await_answer(self, number: int, timeout: float | None = None) -> Frame:
        self._awaited = number
        self._answers.clear()
        while not self._answers:
            if not self.listen(timeout):
                raise RunEndedError(f"no data for {timeout:g} s")
        return self._answers[0]

    def _send(self, data: bytes) -> None:
        try:
            if len(data) <= _SMALL:
                self._socket.sendall(data)
            else:
                self._send_large(data)
        except (OSError, ValueError):  # the second if another thread has closed the connection
            self._set_end("the server has closed the connection")
            raise RunEndedError(self._end) from None

    def _send_large(self, data: bytes) -> None:
        """Send more than the system may take at once, and read meanwhile, so that neither end waits."""
        rest = memoryview(data)
        self._socket.setblocking(False)
        try:
            while rest and self._end is None:
                readable, writable, _ = select.select([self._socket], [self._socket], (), _SELECT_TIMEOUT)
                if readable:
                    self._read()
                if writable:
                    rest = rest[self._socket.send(rest) :]
        finally:
            self._socket.setblocking(True)

    def _read(self) -> None:
        try:
            data = self._socket.recv(_RECEIVE_SIZE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if not data:
            self._set_end("the server has closed the connection")
            return
        try:
            for frame in self._decoder.feed(data):
                self._take(frame)
        except FrameError as error:
            self._set_end(f"not a Cellwright server: {error}")

    def _take(self, frame: Frame) -> None:
        match frame.kind:
            case FrameKind.MESSAGE:
                self._on_frame(frame)
            case FrameKind.ENDED:
                self._set_end(printable(frame.text()))
            case FrameKind.REFUSED if frame.number == 0:
                self._set_end(printable(frame.text()))
            case _ if frame.number in self._expected:
                self._expected.pop(frame.number).append(frame)
            case _ if frame.number == self._awaited:
                self._answers.append(frame)
            case _:  # an answer of a stream, or to a request that the caller abandoned
                self._on_frame(frame)

    def _set_end(self, reason: str) -> None:
        self._end = self._end or reason


class _RemoteUnknownNameError(UnknownNameError):
    """An unknown name, with the server's own sentence."""

    def __init__(self, sentence: str) -> None:
        self._sentence = sentence
        super().__init__("name", "", ())

    def sentence(self) -> str:
        return self._sentence


def check_answer(answer: Frame) -> Frame:
    """Return an answer, or raise a refusal as its error, of a class that this process knows."""
    if answer.kind is not FrameKind.REFUSED:
        return answer
    found = getattr(errors, answer.name, CellwrightError)
    if found is UnknownNameError:
        found = _RemoteUnknownNameError
    elif not isinstance(found, type) or not issubclass(found, (CellwrightError, RunEndedError)):
        found = CellwrightError
    raise found(printable(answer.text()))


class SocketTransport:
    """Transport to a cell served at an address (host and port), which sees it as the node `node`.

    Messages have the encoding that `encoding` names, one of those of `types`.

    Raises:
        UsageError: no server answers there.
    """

    def __init__(
        self, address: tuple[str, int], *, node: str = "/client", encoding: str = "cdr", types: TypeSet = TYPES
    ) -> None:
        self.node = node
        self.types = types
        self._write, self._read = types.encodings[encoding]
        self._deliveries: dict[int, Callback] = {}
        self._mail: deque[tuple[Callback, bytes]] = deque()
        self._news = 0  # messages since the newest clock
        self._followers: list[Follower] = []
        self._connection = SocketConnection(address, node=node, encoding=encoding, on_frame=self._take)
        self.welcome = welcome = self._connection.welcome
        """The cell's description of itself."""
        self._types = {each["name"]: str(each["type"]) for each in welcome["topics"]}
        self._services = {each["name"]: str(each["type"]) for each in welcome["services"]}
        self._now = int(welcome["time"])
        self._lockstep = bool(welcome["lockstep"])
        self._clock = 0
        self._has_clock = "/clock" in self.topics()
        self._clock_offset = self._now - time.perf_counter_ns()
        if not self._lockstep and self._has_clock:
            self._clock = self._connection.number()
            self._connection.ask(Frame(FrameKind.SUBSCRIBE, self._clock, "/clock"))

    knows_all_topics = True

    def now(self) -> int:
        """Return simulation time [ns]; without a clock, the time since the connection was made counts on."""
        if not self._lockstep and not self._has_clock:
            self._now = time.perf_counter_ns() + self._clock_offset
        elif not self._lockstep:
            try:
                while self._connection.listen(0.0):
                    pass
            except RunEndedError:
                pass  # time stands still then; the next call that lets time pass raises
        return self._now

    def advance(self, until: int | None, finished: Callable[[], bool] | None = None) -> None:
        """Let time pass to `until` [ns], or until `finished()`; deliver messages after each tick."""
        let_pass = self._wait_for_time if self._has_clock else self._wait_by_the_wall
        if self._lockstep:
            let_pass = self._ask_for_time
        while until is None or self._now < until:
            let_pass(_END_OF_TIME if until is None else until, finished is not None)
            deliver_all(self._mail)
            if finished is not None and finished():
                return

    def subscribe(self, topic: str, callback: Callback, *, passive: bool = False) -> Callable[[], None]:
        """Deliver a topic's messages while time passes; the returned function ends that."""
        number = self._connection.number()
        message_class: type[Message] | None = None
        is_active = True

        def deliver(data: bytes) -> None:
            nonlocal message_class
            if is_active:
                message_class = message_class or self.types.message(self._types[topic])
                callback(self._read(data, message_class))

        def leave() -> None:
            nonlocal is_active
            if is_active:
                # Messages in the queue are not delivered any more either.
                is_active = False
                if self._deliveries.pop(number, None) is not None:  # none is left of a client that was closed
                    self._connection.send(Frame(FrameKind.UNSUBSCRIBE, number))

        # Latched messages come before the answer.
        self._deliveries[number] = deliver
        try:
            self._connection.ask(Frame(FrameKind.SUBSCRIBE, number, topic, QUIET if passive else ""))
        except CellwrightError:
            del self._deliveries[number]
            raise
        return leave

    def publish(self, topic: str, message: Any) -> None:
        """Send a message; the cell acts on it between two steps."""
        message = self.types.checked(message)
        frame = Frame(
            FrameKind.PUBLISH, self._connection.number(), topic, type_of(type(message)), payload=self._write(message)
        )
        self._connection.ask(frame)

    def call(self, service: str, request: Any) -> Any:
        """Call a service; the cell handles it between two steps. Time passes if its answer takes some."""
        request = self.types.checked(request)
        name = type_of(type(request)).removesuffix(_REQUEST_SUFFIX)
        frame = Frame(FrameKind.CALL, self._connection.number(), service, name, payload=self._write(request))
        answer = self._connection.ask(frame)
        if answer.kind is FrameKind.DONE:
            answer = self._wait_for(frame.number)
        return self._read(answer.payload, self.types.service(self._services[service]).response)

    def ask_server(self, service: str, request: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Call a service of the server itself, such as "simulation/GetEntities", with a JSON object; return another."""
        payload = json.dumps(request or {}).encode()
        return self._connection.ask(Frame(FrameKind.CALL, self._connection.number(), service, payload=payload)).json()

    def topics(self) -> dict[str, str]:
        """Return the types of the topics that the cell publishes, by name."""
        return {each["name"]: str(each["type"]) for each in self.welcome["topics"] if each["direction"] == "out"}

    def follow(self, follower: Follower) -> None:
        """Have a follower forget what it knows when time goes back: the run was reset, or a snapshot was restored."""
        self._followers.append(follower)

    def close(self) -> None:
        """Disconnect from the cell."""
        self._connection.close()
        self._deliveries.clear()
        self._mail.clear()

    def _ask_for_time(self, until: int, each_tick: bool) -> None:  # noqa: FBT001
        self._news = len(self._mail)
        self._set_time(read_time(self._connection.ask(advance(self._connection.number(), until, each_tick=each_tick))))

    def _set_time(self, now: int) -> None:
        """Set the time [ns]; when it goes back, nothing of the time before is of use but the newest messages."""
        if now < self._now:
            while len(self._mail) > self._news:
                self._mail.popleft()
            for follower in self._followers:
                follower.forget()
        self._now = now
        self._news = 0

    def _wait_for(self, number: int) -> Frame:
        """In lockstep: let time pass, tick by tick, until a call is answered."""
        replies = self._connection.expect_reply(number)
        while not replies:
            self._ask_for_time(_END_OF_TIME, each_tick=True)
        return check_answer(replies[0])

    def _wait_for_time(self, _until: int, _each_tick: bool) -> None:  # noqa: FBT001
        before = self._now
        while self._now == before and not self._mail:
            self._connection.listen(None)

    def _wait_by_the_wall(self, until: int, each_tick: bool) -> None:  # noqa: FBT001
        while not self._mail and (left := until - self.now()) > 0:
            self._connection.listen(min(left / 1e9, _POLL_INTERVAL))
            if each_tick:
                break
        self.now()

    def _take(self, frame: Frame) -> None:
        """Queue a message; it is delivered when time passes."""
        if frame.kind is not FrameKind.MESSAGE:
            return
        deliver = self._deliveries.get(frame.number)
        if deliver is not None:
            self._mail.append((deliver, frame.payload))
            self._news += 1
        elif frame.number == self._clock:
            stamp = self._read(frame.payload, self.types.message("rosgraph_msgs/Clock")).clock  # type: ignore[attr-defined]
            self._set_time(nanoseconds(stamp))
