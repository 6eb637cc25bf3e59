"""Poller of the page: a thread that takes scenes, frames and panels from the connection, in order."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, TypeAlias

from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import decode_frame, decode_scene
from cellwright.util.errors import CellwrightError, MessageError
from cellwright.viewer.services.names import FRAME, SCENE
from cellwright.viewer.web.connection import AwayError, Connection

MAX_RESULTS = 20
"""Number of results that may wait for the page; while more do, it takes no frame, and the server soon sends none."""
_IDLE = 2.0  # [s] between two requests without a browser
_AWAY = 1.0  # [s] between attempts to reconnect
_LISTENS = 0.25  # [s] for which it listens at most, before it looks for browsers
_FULL = 0.05  # [s] between two looks at results that wait

log = logging.getLogger(__name__)


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

    While a browser is connected, the server sends frames of itself. Otherwise the poller asks for one now and then.

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
        self._is_streaming = False
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
            try:
                pause = self._look()
            except Exception as error:  # no answer, or none that makes sense
                if not isinstance(error, CellwrightError):
                    log.exception("invalid answer from %s:%d", *self._link.address)
                self._newest = None
                self._link.close()
                self.results.put(error if isinstance(error, AwayError) else AwayError(str(error)))
                pause = _AWAY
            if pause > 0.0:
                self._wake.wait(pause)
        self._link.close()

    def _look(self) -> float:
        """Take the next frame, if one comes; return the pause [s] before the one after it."""
        if self.results.qsize() >= MAX_RESULTS:
            return _FULL
        if self.is_watched:
            is_first = self._newest is None or not self._is_streaming
            self._is_streaming = True
            found = self._link.next_frame(self._wants(), _LISTENS, is_first=is_first)
            if found is not None:
                self._take(*found)
            return 0.0
        if self._is_streaming:
            self._is_streaming = False
            self._link.end_stream()
        since = {} if self._newest is None else {"since": self._newest[0]}
        self._take(*self._link.ask_data(FRAME, **since))
        return _IDLE

    def _take(self, answer: dict[str, Any], data: memoryview) -> None:
        if answer.get("digest") != self._digest:
            self._newest = None  # the frame is a whole one
            self._ask_for_scene()
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
        if isinstance(panel := answer.get("panel"), dict):
            self.results.put(NewPanel(panel))

    def _ask_for_scene(self) -> None:
        answer, data = self._link.ask_data(SCENE)
        scene = decode_scene(bytes(data))
        if not isinstance(digest := answer.get("digest"), str):
            raise MessageError(f"{SCENE}: answer has no scene")
        self._digest, self._bodies = digest, len(scene.bodies)
        metadata = answer.get("about")
        self.results.put(NewScene(scene, metadata if isinstance(metadata, dict) else {}))
