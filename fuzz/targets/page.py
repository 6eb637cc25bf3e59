"""Browser frames at the page of a cell or a robot: they are handled or dropped, and harm no other client.

An input is a list in MessagePack: 0 for the page of a cell or 1 for that of a robot, then the frames. A map is sent
as a message, bytes as they are, a text as a text frame; any other input is sent unchanged. In a map a number for a
`uuid` stands for an existing element, and one for `name` for a handle in the scene.
"""

from __future__ import annotations

import contextlib
import io
import logging
import math
import random
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import msgspec
import numpy as np
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

from cellwright.cell.cell import Cell
from cellwright.config.robot.robots import load_robot
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.robot.node import RobotNode
from cellwright.viewer.services import scene
from cellwright.viewer.services.cell_panel import CellPanel
from cellwright.viewer.services.control import Control, PanelSource, Reset
from cellwright.viewer.services.robot_panel import RobotPanel
from cellwright.viewer.web.access import AccessGuard
from cellwright.viewer.web.connection import ServerConnection
from cellwright.viewer.web.operator.feature import Operator
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.program import ViserServer, features
from fuzz.trees import mutated
from fuzz.verdict import FindingError

MAX_SIZE = 4000
WORDS = (
    *("type", "uuid", "updates", "value", "name", "wxyz", "position", "frequency", "owner", "removed", "update_cb"),
    *("props", "visible", "disabled", "options", "sync_cb", "source_component_uuid", "transfer_uuid", "part_count"),
    *("GuiUpdateMessage", "GuiButtonHoldMessage", "GuiFormDirtyMessage", "GuiFormSubmitMessage", "GuiRemoveMessage"),
    *("TransformControlsUpdateMessage", "TransformControlsDragStartMessage", "TransformControlsDragEndMessage"),
    *("ViewerCameraMessage", "FileTransferStartUpload", "FileTransferPart", "ScenePointerMessage", "ShareUrlRequest"),
    *("Pause", "Resume", "Step", "max", "Start", "AGV 1", "tray 2", "Open", "/scene", "/scene/operator/0/handle"),
)
_MAX_MESSAGES = 20
_PATIENCE = 60.0  # [s]
_CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 1.0, 1.0),
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 100,
    "image_width": 100,
}


class World:
    """A served cell or robot, and a page on it in this process, with a well-behaved viewer."""

    def __init__(self, served: scene.ViewedNode, tell: PanelSource, reset: Reset) -> None:
        self.served = served
        self._server = Server(served, port=0)
        scene.offer_viewer_services(self._server, served, tell, Control(RateControl(1.0), reset=reset))
        self._door = AccessGuard("127.0.0.1", 0)
        with self._door.guards_viser(), contextlib.redirect_stdout(io.StringIO()):
            self.viser = ViserServer(self._door.host, self._door.port, verbose=False)
        self._door.incoming.follow(self.viser.gui)
        self._page = Page(self.viser, ServerConnection(self._server.address), features())
        self._all = self._page.features
        self._thread = threading.Thread(target=self._page.run, daemon=True)
        self._thread.start()
        with self.browser() as good:
            self.wait(self._is_built, "page that is built")
            self._flip(good)
        self.elements = list(self._there().values())
        self._kinds = [type(each.value) for each in self.elements]

    @contextmanager
    def browser(self) -> Iterator[Connection]:
        """Yield a connected browser that reads its frames."""
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        with connect(f"ws://127.0.0.1:{self._door.port}", subprotocols=[protocol], max_size=None) as line:
            reader = threading.Thread(target=_read, args=(line,), daemon=True)
            reader.start()
            line.send(msgspec.msgpack.encode(_CAMERA))
            yield line
        reader.join(_PATIENCE)

    def wait(self, condition: Callable[[], bool], label: str) -> None:
        """Run and serve until a condition holds."""
        end = time.monotonic() + _PATIENCE
        while not condition():
            if time.monotonic() > end:
                raise FindingError(f"no {label}")
            self.served.simulation.step()
            self._server.wait(0.002)

    def take(self, messages: list[Any]) -> None:
        """Send messages from one browser, and check that no other is harmed."""
        with contextlib.suppress(ConnectionClosed), self.browser() as bad:
            for message in messages[:_MAX_MESSAGES]:
                bad.send(self._encoded(message))
            self._flip(bad)  # by its end, all messages before have been handled
        with self.browser() as good:
            self._flip(good)
        self._check()

    def _is_built(self) -> bool:
        """Return whether the page has all its elements; those of a robot come with its first message."""
        labels = {each.label for each in self._there().values()}
        parts = [each for each in self._all if isinstance(each, Operator)]
        return "Names" in labels and all(not each._is_robot or each._controls is not None for each in parts)

    def _there(self) -> dict[str, Any]:
        """Return the input elements by identifier."""
        return dict(self.viser.gui._gui_input_handle_from_uuid)

    def _flip(self, line: Connection) -> None:
        """Toggle a checkbox of the panel, which the page handles at once."""
        box = next(each for each in self._there().values() if each.label == "Names")
        goal = not box.value
        line.send(_update(box, value=goal))

        def is_done() -> bool:
            if box.value != goal and line.state.name != "OPEN":
                raise ConnectionClosed(None, None)
            return bool(box.value == goal)

        self.wait(is_done, "answer to a browser that does no harm")

    def _encoded(self, message: Any) -> bytes | str:
        if isinstance(message, dict):
            message = dict(message)
            for key in ("uuid", "source_component_uuid"):
                if isinstance(message.get(key), int):
                    message[key] = self.elements[message[key] % len(self.elements)]._impl.uuid
            if isinstance(message.get("name"), int):
                message["name"] = f"/scene/operator/{message['name'] % 2}/handle"
        return message if isinstance(message, bytes | str) else msgspec.msgpack.encode(message)

    def _check(self) -> None:
        """Check that page and node are intact."""
        if not self._thread.is_alive() or self._page.features != self._all:
            raise FindingError("the page has lost a part of itself")
        for element, kind in zip(self.elements, self._kinds, strict=True):
            parts = element._impl
            if parts.removed or type(element.value) is not kind or not isinstance(parts.update_cb, list):
                raise FindingError(f"{element.label!r} is no longer what it was: {element.value!r:.100}")
            if kind is float and not math.isfinite(element.value):
                raise FindingError(f"{element.label!r} stands at {element.value}")
        kept = list(self.viser._websock_server._broadcast_buffer.message_from_id.values())
        if any(type(message).__name__.startswith(("GuiForm", "FileTransfer")) for message in kept):
            raise FindingError("something of a browser is kept for all who come later")
        if not np.isfinite(self.served.simulation.data.qpos).all():
            raise FindingError("the state is not finite")


@cache
def world(number: int) -> World:
    """Return the cell of the lesson in development mode, or a robot."""
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # as in the page's own program
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)
    if number == 0:
        cell = Cell(load_trial([find_trial("lesson")]).trial, competition=False)
        panel = CellPanel(cell)
        return World(cell, lambda _request: panel.panel(), Reset(cell.reset))
    node = RobotNode(load_robot("tandem", lambda _line: None))
    return World(node, RobotPanel(node).state, Reset(lambda: None))


def seeds() -> Iterator[bytes]:
    """Yield the frames of the page's own client, and inputs of former findings."""
    update = {"type": "GuiUpdateMessage", "uuid": 0, "updates": {"value": True}}
    part = {"type": "FileTransferStartUpload", "source_component_uuid": 3, "transfer_uuid": "a", "filename": "a"}
    for number in (0, 1):
        for uuid in range(12):
            for value in (True, 1.0, "Pause", "max", "AGV 1", None, [1, 2]):
                yield msgspec.msgpack.encode([number, update | {"uuid": uuid, "updates": {"value": value}}])
        for message in (
            {**_CAMERA, "fov": 0.5},
            update | {"updates": {"removed": True}},
            update | {"updates": {"update_cb": 7, "value": False}},
            {"type": "GuiFormDirtyMessage", "uuid": "x"},
            part | {"mime_type": "", "part_count": 0, "size_bytes": 0},
            {"type": "GuiButtonHoldMessage", "uuid": 0, "frequency": 10.0},
            {"type": "TransformControlsDragStartMessage", "name": 0, "owner": ""},
            {"type": "TransformControlsUpdateMessage", "name": 0, "wxyz": (1, 0, 0, 0), "position": (0, 0, 1)},
            b"\xc1",
            "text",
        ):
            yield msgspec.msgpack.encode([number, message])
    yield b"\x91" * 1000


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return other messages."""
    try:
        return msgspec.msgpack.encode(mutated(msgspec.msgpack.decode(data), chance, WORDS))
    except (ValueError, TypeError, OverflowError, RecursionError, msgspec.MsgspecError):
        return None


def attempt(data: bytes) -> None:
    """Send the frames in the bytes, and check the page from another browser."""
    number, messages = 0, [data]
    with contextlib.suppress(ValueError, RecursionError, msgspec.MsgspecError):
        found = msgspec.msgpack.decode(data)
        if isinstance(found, list) and found and isinstance(found[0], int):
            number, messages = found[0] % 2, found[1:]
    heard = io.StringIO()
    place = world(number)
    with _noted(heard):
        place.take(messages)
    if heard.getvalue():
        raise FindingError(f"said on the terminal:\n{heard.getvalue()[:3000]}")


@contextmanager
def _noted(heard: io.StringIO) -> Iterator[None]:
    """Record the output of a terminal: texts, warnings, log records, and threads that fail."""

    def note(message: Warning | str, *_args: object, **_more: object) -> None:
        heard.write(f"warning: {message}\n")

    handler = logging.StreamHandler(heard)
    hook, threading.excepthook = threading.excepthook, lambda failed: heard.write(f"thread: {failed.exc_value!r}\n")
    logging.getLogger().addHandler(handler)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", DeprecationWarning)  # those of viser's have nothing to do with browsers
        warnings.showwarning = note
        try:
            with contextlib.redirect_stderr(heard):
                yield
        finally:
            threading.excepthook = hook
            logging.getLogger().removeHandler(handler)


def _update(element: Any, *, value: object) -> bytes:
    message = {"type": "GuiUpdateMessage", "uuid": element._impl.uuid, "updates": {"value": value}}
    return msgspec.msgpack.encode(message)


def _read(line: Connection) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            line.recv()
