"""Connection of the page to the server: requests, commands, and the stream of frames and panels."""

import json
import os
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol, TypeVar

from cellwright.clients.client.socket_transport import SocketConnection, check_answer
from cellwright.middleware.messages import TYPES, TypeSet, type_of
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError
from cellwright.viewer.services.names import FRAME, PAGE

T = TypeVar("T")

AHEAD = 40
"""Number of frames that the server sends before the page asks for more: those of two seconds."""
_REQUEST = "_Request"
_TIMEOUT = 10.0  # [s], timeout of the greeting


class AwayError(CellwrightError):
    """Error of a server that does not answer; it may come back."""


class Connection(Protocol):
    """Connection of a page to what it shows. Its methods raise CellwrightError for a refused request."""

    address: tuple[str, int]
    """Host and port of the server; ("", 0) without one."""
    welcome: dict[str, Any]
    """Welcome message of the server; empty without one."""

    def sibling(self) -> "Connection":
        """Return a connection to the same source, which no request of this one holds up."""
        ...

    def ask(self, service: str, **request: Any) -> dict[str, Any]:
        """Call a service that answers with JSON."""
        ...

    def ask_data(self, service: str, **request: Any) -> tuple[dict[str, Any], memoryview]:
        """Call a service that answers with JSON and bytes."""
        ...

    def next_frame(
        self, request: dict[str, Any], timeout: float, *, is_first: bool
    ) -> tuple[dict[str, Any], memoryview] | None:
        """Return the next answer of the frame service, some with a `panel`; None if none comes within `timeout` [s].

        Args:
            request: the overlays.
            timeout: wall time [s].
            is_first: True to get a whole frame; else the one after the last one, with the changes.
        """
        ...

    def end_stream(self) -> None:
        """Let no more frames come, until the next call of `next_frame`."""
        ...

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message."""
        ...

    def call(self, service: str, request: Any) -> Any:
        """Call a service of the bus; return the response."""
        ...

    def close(self) -> None:
        """Close the connection."""
        ...


class ServerConnection:
    """Connection to the server. Several threads may use it; each waits for its answer.

    It connects on first use, and reconnects on use after a loss. All methods raise AwayError if the server does not
    answer, and CellwrightError for a refused request; the text says why.

    Args:
        address: host and port of the served cell or robot.
        node: its node name as a client.
        key: the server's key for its own page, which a competition gives to no other client.
        types: set of types of its messages.
    """

    def __init__(self, address: tuple[str, int], *, node: str = "", key: str = "", types: TypeSet = TYPES) -> None:
        self.address = address
        self._key, self._types = key, types
        self.node = node or f"{PAGE}{os.getpid()}"
        self.welcome: dict[str, Any] = {}
        """Welcome message of the last connection: `trial`, `topics`, `services`, `lockstep` …"""
        self._connection: SocketConnection | None = None
        self._lock = threading.RLock()
        self._stream: Frame | None = None  # the call that the server answers with frames
        self._left = 0  # number of its answers that may still come
        self._frames: deque[Frame] = deque()

    @property
    def is_there(self) -> bool:
        """True if the server answered the last request."""
        return self._connection is not None

    def sibling(self) -> "ServerConnection":
        """See `Connection`."""
        return ServerConnection(self.address, node=f"{self.node}_eyes", key=self._key, types=self._types)

    def connect(self) -> None:
        """Connect, or reconnect."""
        with self._lock:
            self.close()
            try:
                self._connection = SocketConnection(
                    self.address, node=self.node, encoding="cdr", on_frame=self._take, timeout=_TIMEOUT, key=self._key
                )
            except CellwrightError as error:
                raise AwayError(str(error)) from None
            self.welcome = self._connection.welcome

    def ask(self, service: str, **request: Any) -> dict[str, Any]:
        """Call a service of the server itself (JSON), such as `cellwright/panel`.

        Raises:
            UnknownNameError: the server has no such service.
        """
        return self._ask_server(service, request, Frame.json)

    def ask_data(self, service: str, **request: Any) -> tuple[dict[str, Any], memoryview]:
        """Call a service of the server that answers with JSON and bytes, such as `cellwright/frame`, as `ask` does."""
        return self._ask_server(service, request, Frame.data)

    def next_frame(
        self, request: dict[str, Any], timeout: float, *, is_first: bool
    ) -> tuple[dict[str, Any], memoryview] | None:
        """See `Connection`. The server sends frames of itself, as long as this is called, and a few more."""
        payload = json.dumps({**request, "ahead": AHEAD}).encode()
        with self._lock:
            if self._connection is None:
                self.connect()
            assert self._connection is not None
            try:
                if is_first or self._stream is None or self._stream.payload != payload:
                    self._frames.clear()  # those of another stream
                    self._stream = Frame(FrameKind.CALL, self._connection.number(), FRAME, payload=payload)
                    self._left = 0
                if self._left <= AHEAD // 2:
                    self._connection.send(self._stream)
                    self._left = AHEAD
                if not self._frames:
                    self._connection.listen(timeout)
            except RunEndedError as ended:
                raise self._lost(ended) from None
            if not self._frames:
                return None
            self._left -= 1
            return _read(FRAME, check_answer(self._frames.popleft()), Frame.data)

    def end_stream(self) -> None:
        """See `Connection`."""
        with self._lock:
            if self._connection is not None and self._stream is not None:
                try:
                    self._connection.send(Frame(FrameKind.UNSUBSCRIBE, self._stream.number))
                except RunEndedError as ended:
                    raise self._lost(ended) from None
            self._stream = None

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message as any client does; the server refuses it, or acts on it even while time is paused."""
        self._ask(Frame(FrameKind.PUBLISH, 0, topic, type_of(type(message)), payload=self._types.to_cdr(message)))

    def call(self, service: str, request: Any) -> Any:
        """Call a service of the bus; return the response."""
        name = type_of(type(request)).removesuffix(_REQUEST)
        if not self.is_there:
            self.connect()
        types = {each["name"]: str(each["type"]) for each in self.welcome.get("services", ())}
        if service not in types:
            raise UnknownNameError("service", service, types)
        answer = self._ask(Frame(FrameKind.CALL, 0, service, name, payload=self._types.to_cdr(request)))
        if answer.kind is FrameKind.DONE:
            raise CellwrightError(
                f"{service} responds only after simulation time has passed; the page does not wait for it"
            )
        return self._types.from_cdr(answer.payload, self._types.service(types[service]).response)

    def close(self) -> None:
        """Close the connection."""
        with self._lock:
            if self._connection is not None:
                self._connection.close()
            self._connection = self._stream = None

    def _ask_server(self, service: str, request: dict[str, Any], read: Callable[[Frame], T]) -> T:
        return _read(service, self._ask(Frame(FrameKind.CALL, 0, service, payload=json.dumps(request).encode())), read)

    def _ask(self, frame: Frame) -> Frame:
        with self._lock:
            if self._connection is None:
                self.connect()
            assert self._connection is not None
            try:
                return self._connection.ask(replace(frame, number=self._connection.number()))
            except RunEndedError as ended:
                raise self._lost(ended) from None

    def _take(self, frame: Frame) -> None:
        if self._stream is not None and frame.number == self._stream.number:
            self._frames.append(frame)

    def _lost(self, ended: RunEndedError) -> AwayError:
        self.close()
        return AwayError(str(ended) or "the server has closed the connection")


def _read(service: str, answer: Frame, read: Callable[[Frame], T]) -> T:
    try:
        return read(answer)
    except FrameError as error:
        raise CellwrightError(f"{service}: {error}") from None
