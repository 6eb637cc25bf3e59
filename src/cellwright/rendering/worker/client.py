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
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.worker import wire
from cellwright.util.errors import RenderingError, printable
from cellwright.util.process import ChildProcess

_CLOSE_TIMEOUT = 20.0  # [s], for pending requests


class RenderWorker(ChildProcess):
    """Process that draws scenes.

    It ends when it is closed, and when its parent ends in any way. Either way it finishes all requests first.

    Args:
        scene: the scene to draw, its number 0; others are added by a request `scene`.
        max_pending: number of pending requests at which `has_room` turns False.

    Raises:
        UsageError: the environment sets a backend that does not exist.

    Attributes:
        error: reason why it ended without `close`; empty otherwise.
    """

    def __init__(self, scene: Scene | None = None, *, max_pending: int = 8) -> None:
        requested_backend()  # refused here, in the caller's process
        self.error = ""
        self._max_pending = max_pending
        self._waiting: dict[int, Future[Any]] = {}
        self._changed = threading.Condition()
        self._number = 0
        self._is_closing = False
        log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the process)
        super().__init__(wire.command(), environment=_environment(os.environ), stderr=log, read=self._read)
        self.ready: Future[str] = self.ask("scene", 0, scene or Scene("", ("world",), (), ()))
        """Name of its renderer, once that is known."""

    @property
    def has_room(self) -> bool:
        """True if it accepts a request without falling behind."""
        return len(self._waiting) < self._max_pending

    def wait_for_room(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` [s] for room; return whether there is any."""
        with self._changed:
            return self._changed.wait_for(lambda: self.has_room, timeout)

    def colour(self, frame: SceneFrame, request: PictureRequest, scene: int = 0) -> Future[NDArray[np.uint8]]:
        """Request a picture (height, width, 3), sRGB, of the scene with this number."""
        return self.ask("colour", scene, frame, request)

    def depth(self, frame: SceneFrame, request: PictureRequest, scene: int = 0) -> Future[NDArray[np.float32]]:
        """Request the depths [m] (height, width) of the scene with this number; see `CastRenderer.depth`."""
        return self.ask("depth", scene, frame, request)

    def ask(self, method: str, *arguments: object) -> Future[Any]:
        """Call a method of `Drawing` in the process.

        Returns:
            Its future result. The future raises RenderingError if the call fails or the process has ended.
        """
        future: Future[Any] = Future()
        with self._changed:
            if self.error or self._is_closing:
                future.set_exception(RenderingError(self.error or "renderer is closed"))
                return future
            self._number += 1
            number = self._number
            self._waiting[number] = future
        with suppress(OSError, ValueError):  # it has ended, and the reading thread knows why
            wire.write(self._stdin, (number, method, arguments))
        return future

    def close(self, timeout: float = _CLOSE_TIMEOUT) -> None:
        """Let it finish its requests within `timeout` [s], and end it."""
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
                words = printable(self.last_output(), 300)
                self.error = f"render process has ended{f': {words}' if words else ''}"
            left = [*self._waiting.values()]
            self._waiting.clear()
            self._changed.notify_all()
        for future in left:
            future.set_exception(RenderingError(self.error))


def _environment(own: Mapping[str, str]) -> dict[str, str]:
    """Environment of this process without settings for graphics: the render process makes them itself."""
    kept = {name: value for name, value in own.items() if name not in ("PYOPENGL_PLATFORM", "DISPLAY")}
    return {**kept, "MUJOCO_GL": "disable"}
