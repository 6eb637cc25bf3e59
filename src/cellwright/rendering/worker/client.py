"""Render process client: starts the process, sends frames, and returns pictures when they are ready."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Mapping
from concurrent.futures import Future
from contextlib import suppress
from types import TracebackType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.backend import requested_backend
from cellwright.rendering.picture import PictureRequest
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.worker import wire
from cellwright.util.errors import RenderingError, showable
from cellwright.util.process import ChildProcess

_CLOSE_TIMEOUT = 20.0  # [s], for what was asked for last


class RenderWorker(ChildProcess):
    """A process that draws one scene.

    It ends when it is closed, and when the process that holds it ends, however that happens; it then finishes first
    what it was asked for.

    Args:
        scene: what is to be drawn.
        most: how much may wait to be drawn before `has_room` says no.

    Raises:
        UsageError: the environment settles a way to draw that does not exist.

    Attributes:
        error: why it has ended by itself; empty while all is well.
    """

    def __init__(self, scene: Scene, *, most: int = 8) -> None:
        requested_backend()  # refused here, where somebody hears of it
        self.error = ""
        self._most = most
        self._waiting: dict[int, Future[Any]] = {}
        self._changed = threading.Condition()
        self._number = 0
        self._is_closing = False
        log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the process)
        super().__init__(wire.command(), environment=_environment(os.environ), stderr=log, read=self._read)
        self.ready: Future[str] = self.ask("scene", scene)
        """What it draws with, in words, once that is known."""

    @property
    def has_room(self) -> bool:
        """Whether it can be asked for more before it has caught up."""
        return len(self._waiting) < self._most

    def wait_for_room(self, timeout: float | None = None) -> bool:
        """Wait until it can be asked for more, at most so long [s]; whether it can."""
        with self._changed:
            return self._changed.wait_for(lambda: self.has_room, timeout)

    def colour(self, frame: Frame, asked: PictureRequest) -> Future[NDArray[np.uint8]]:
        """Ask for a picture (height, width, 3), sRGB."""
        return self.ask("colour", frame, asked)

    def depth(self, frame: Frame, asked: PictureRequest) -> Future[NDArray[np.float32]]:
        """Ask for how far [m] everything is (height, width); see `CastRenderer.depth`."""
        return self.ask("depth", frame, asked)

    def ask(self, what: str, *arguments: object) -> Future[Any]:
        """Ask for something by the name of a method of `Drawing`.

        Returns:
            What will come of it; it raises RenderingError where it cannot be done, or the process has ended.
        """
        future: Future[Any] = Future()
        with self._changed:
            if self.error or self._is_closing:
                future.set_exception(RenderingError(self.error or "what draws is closed"))
                return future
            self._number += 1
            number = self._number
            self._waiting[number] = future
        with suppress(OSError, ValueError):  # it has ended, and the thread that reads says why
            wire.write(self._stdin, (number, what, arguments))
        return future

    def close(self, timeout: float = _CLOSE_TIMEOUT) -> None:
        """Have it finish what it was asked for, within a time [s], and end."""
        with self._changed:
            self._is_closing = True
        self.end(timeout)

    def __enter__(self) -> RenderWorker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _read(self, stdout: IO[bytes]) -> None:
        with suppress(OSError):
            while (answer := wire.read(stdout)) is not None:
                self._take(*answer)
        self._over()

    def _take(self, number: int, value: object, error: str) -> None:
        with self._changed:
            future = self._waiting.pop(number)
            self._changed.notify_all()
        if error:
            future.set_exception(RenderingError(error))
        else:
            future.set_result(value)

    def _over(self) -> None:
        with self._changed:
            if not self._is_closing or self._waiting:
                words = showable(self.last_words(), 300)
                self.error = f"the process that draws has ended{f': {words}' if words else ''}"
            left = [*self._waiting.values()]
            self._waiting.clear()
            self._changed.notify_all()
        for future in left:
            future.set_exception(RenderingError(self.error))


def _environment(own: Mapping[str, str]) -> dict[str, str]:
    """That of this process, but for what settles how the engine and others draw: the program does that itself."""
    kept = {name: value for name, value in own.items() if name not in ("PYOPENGL_PLATFORM", "DISPLAY")}
    return {**kept, "MUJOCO_GL": "disable"}
