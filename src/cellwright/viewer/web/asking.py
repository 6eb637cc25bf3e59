"""Asks what is served how it stands, in a thread of its own, as often as somebody looks on."""

from __future__ import annotations

import logging
import threading
import time
from base64 import b64decode
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from cellwright.rendering.scene import Frame
from cellwright.rendering.scene.encoded import decode_scene
from cellwright.rendering.scene.frame import decode
from cellwright.util.errors import CellwrightError, MessageError, UnknownNameError
from cellwright.viewer.services.names import FRAME, PANEL, SCENE
from cellwright.viewer.web.link import AwayError, Link

log = logging.getLogger(__name__)

_FRAMES = 1 / 30  # [s] between two questions, at most as often
_PANELS = 0.25
_IDLE = 2.0  # [s] while nobody looks on
_AWAY = 1.0  # [s] until somebody who is away is looked for again
_SHARE = 0.5  # of the time at most is spent waiting for answers: who is slow to answer is asked less often


class Asking:
    """The page's questions.

    What comes of them is put into `found`, in order: a tuple of a Scene and what is said about it when it is
    another one; a tuple of the moment [s] of the
    wall clock, a Frame and the whole answer; a dict that the panel shows; an AwayError.

    Args:
        link: of its own: nobody waits for anybody.
        wants: what the frame service is to be asked for besides.
    """

    def __init__(self, link: Link, wants: Callable[[], dict[str, Any]]) -> None:
        self.found: SimpleQueue[Any] = SimpleQueue()
        self.is_watched = False
        """Whether somebody looks on."""
        self._link = link
        self._wants = wants
        self._digest = ""
        self._bodies = 0
        self._has_panel = True
        self._panel_due = 0.0
        self._wake = threading.Event()
        self._is_over = False
        self._thread = threading.Thread(target=self._run, name="asking", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def wake(self) -> None:
        """Ask now."""
        self._wake.set()

    def close(self) -> None:
        """Ask no more."""
        self._is_over = True
        self._wake.set()

    def _run(self) -> None:
        while not self._is_over:
            self._wake.clear()
            begun = time.perf_counter()
            try:
                self._ask()
                pause = _FRAMES if self.is_watched else _IDLE
            except AwayError as away:
                self.found.put(away)
                self._has_panel, self._panel_due = True, 0.0
                pause = _AWAY
            except Exception as error:  # what answers there has nothing to show, or nothing that makes sense
                if not isinstance(error, CellwrightError):
                    log.exception("what %s:%d answers cannot be shown", *self._link.address)
                self._link.close()
                self.found.put(AwayError(str(error)))
                pause = _AWAY
            spent = time.perf_counter() - begun
            self._wake.wait(max(pause - spent, spent * (1 / _SHARE - 1)))
        self._link.close()

    def _ask(self) -> None:
        answer = self._link.ask(FRAME, **self._wants())
        if answer.get("digest") != self._digest:
            self._ask_for_scene()
            answer = self._link.ask(FRAME, **self._wants())
        frame = _frame(answer)
        if len(frame.poses) != self._bodies:
            self._digest = ""  # it is asked for anew
            raise MessageError("the frame is not one of the scene")
        self.found.put((time.perf_counter(), frame, answer))
        now = time.perf_counter()
        if self._has_panel and self.is_watched and now >= self._panel_due:
            self._panel_due = now + _PANELS
            try:
                self.found.put(self._link.ask(PANEL))
            except UnknownNameError:
                self._has_panel = False

    def _ask_for_scene(self) -> None:
        answer = self._link.ask(SCENE)
        try:
            scene = decode_scene(b64decode(answer["scene"]))
            self._digest, self._bodies = str(answer["digest"]), len(scene.bodies)
        except (KeyError, TypeError, ValueError):
            raise MessageError("the answer holds no scene") from None
        said = answer.get("about")
        self.found.put((scene, said if isinstance(said, dict) else {}))


def _frame(answer: dict[str, Any]) -> Frame:
    try:
        int(answer.get("run", 0))
        return decode(b64decode(answer["frame"]))
    except (KeyError, TypeError, ValueError):
        raise MessageError("the answer holds no frame") from None
