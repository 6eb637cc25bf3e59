"""Connection of the page to the server: requests, commands, and the poller for frames and panels."""

import json
import logging
import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from queue import SimpleQueue
from typing import Any, Protocol, TypeAlias, TypeVar

from cellwright.clients.client.socket_transport import SocketConnection
from cellwright.middleware.messages import TYPES, TypeSet, type_of
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import decode_frame, decode_scene
from cellwright.util.errors import CellwrightError, MessageError, RunEndedError, UnknownNameError
from cellwright.viewer.services.names import FRAME, PAGE, PANEL, SCENE

T = TypeVar("T")

log = logging.getLogger(__name__)

FRAME_PERIOD = 1 / 20
"""Shortest time [s] between two frame requests: the page interpolates, and each one costs the simulation's process."""
_REQUEST = "_Request"
_TIMEOUT = 10.0  # [s], timeout of the greeting
_PANELS = 0.25
_IDLE = 2.0  # [s] without a browser
_AWAY = 1.0  # [s] between attempts to reconnect
_SHARE = 0.5  # largest share of time spent waiting for answers: a slow server gets fewer requests


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
                    self.address,
                    node=self.node,
                    encoding="cdr",
                    on_frame=lambda _frame: None,
                    timeout=_TIMEOUT,
                    key=self._key,
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
            self._connection = None

    def _ask_server(self, service: str, request: dict[str, Any], read: Callable[[Frame], T]) -> T:
        answer = self._ask(Frame(FrameKind.CALL, 0, service, payload=json.dumps(request).encode()))
        try:
            return read(answer)
        except FrameError as error:
            raise CellwrightError(f"{service}: {error}") from None

    def _ask(self, frame: Frame) -> Frame:
        with self._lock:
            if self._connection is None:
                self.connect()
            assert self._connection is not None
            try:
                return self._connection.ask(replace(frame, number=self._connection.number()))
            except RunEndedError as ended:
                self.close()
                raise AwayError(str(ended) or "the server has closed the connection") from None


@dataclass(frozen=True, slots=True)
class NewScene:
    """New scene, and what the server says about it."""

    scene: Scene
    about: dict[str, Any]


@dataclass(frozen=True, slots=True)
class NewFrame:
    """Frame that came at `wall` [s], with the answer that it was part of."""

    wall: float
    frame: SceneFrame
    answer: dict[str, Any]


@dataclass(frozen=True, slots=True)
class NewPanel:
    """Answer of the panel service."""

    panel: dict[str, Any]


PollResult: TypeAlias = NewScene | NewFrame | NewPanel | AwayError
"""Result of a poll; an AwayError if the server did not answer."""


class StatePoller:
    """Poller for frames and panels of the page; it puts results into the queue `results`, in order.

    Args:
        link: a connection that nothing else uses, so that no request waits for another.
        wants: returns the overlays to request with each frame.
    """

    def __init__(self, link: Connection, wants: Callable[[], dict[str, Any]]) -> None:
        self.results: SimpleQueue[PollResult] = SimpleQueue()
        self.is_watched = False
        """True while a browser is connected."""
        self._link = link
        self._wants = wants
        self._digest = ""
        self._bodies = 0
        self._newest: tuple[int, SceneFrame] | None = None  # with its sequence number, which `since` refers to
        self._has_panel = True
        self._panel_due = 0.0
        self._wake = threading.Event()
        self._is_over = False
        self._thread = threading.Thread(target=self._run, name="poller", daemon=True)

    def start(self) -> None:
        """Start polling."""
        self._thread.start()

    def wake(self) -> None:
        """Poll now."""
        self._wake.set()

    def close(self) -> None:
        """Stop polling."""
        self._is_over = True
        self._wake.set()

    def _run(self) -> None:
        while not self._is_over:
            self._wake.clear()
            started_at = time.perf_counter()
            try:
                self._ask()
                pause = FRAME_PERIOD if self.is_watched else _IDLE
            except Exception as error:  # no answer, or none that makes sense
                if isinstance(error, AwayError):
                    self._has_panel, self._panel_due = True, 0.0
                elif not isinstance(error, CellwrightError):
                    log.exception("invalid answer from %s:%d", *self._link.address)
                self._newest = None
                self._link.close()
                self.results.put(error if isinstance(error, AwayError) else AwayError(str(error)))
                pause = _AWAY
            spent = time.perf_counter() - started_at
            self._wake.wait(max(pause - spent, spent * (1 / _SHARE - 1)))
        self._link.close()

    def _ask(self) -> None:
        answer, data = self._ask_for_frame()
        if answer.get("digest") != self._digest:
            self._newest = None
            self._ask_for_scene()
            answer, data = self._ask_for_frame()
        frame = decode_frame(data, None if self._newest is None else self._newest[1])
        if len(frame.poses) != self._bodies:
            self._digest = ""  # so that the scene is requested again
            raise MessageError(
                f"{FRAME}: frame must have the bodies of the scene (got {len(frame.poses)} of {self._bodies})"
            )
        try:
            int(answer.get("run", 0))
            self._newest = int(answer["sequence"]), frame
        except (KeyError, TypeError, ValueError):
            raise MessageError(f"{FRAME}: answer has no frame") from None
        self.results.put(NewFrame(time.perf_counter(), frame, answer))
        if self._has_panel and self.is_watched and (now := time.perf_counter()) >= self._panel_due:
            self._panel_due = now + _PANELS
            try:
                self.results.put(NewPanel(self._link.ask(PANEL)))
            except UnknownNameError:
                self._has_panel = False

    def _ask_for_frame(self) -> tuple[dict[str, Any], memoryview]:
        since = {} if self._newest is None else {"since": self._newest[0]}
        return self._link.ask_data(FRAME, **self._wants(), **since)

    def _ask_for_scene(self) -> None:
        answer, data = self._link.ask_data(SCENE)
        scene = decode_scene(bytes(data))
        if not isinstance(digest := answer.get("digest"), str):
            raise MessageError(f"{SCENE}: answer has no scene")
        self._digest, self._bodies = digest, len(scene.bodies)
        metadata = answer.get("about")
        self.results.put(NewScene(scene, metadata if isinstance(metadata, dict) else {}))
