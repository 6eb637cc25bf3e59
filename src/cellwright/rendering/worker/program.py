"""Render process: chooses a backend, draws pictures on request, and writes videos.

Its requests are a scene, and then what to draw of it; see `client`. It tries the OpenGL backends, each in a process of
its own, since a driver stays loaded, and casts rays in the end. When its input closes, it finishes and ends.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.backend import OPENGL_BACKENDS, RAYS, NoOpenGL, open_context, requested_backend
from cellwright.rendering.engine_renderer import EngineRenderer
from cellwright.rendering.picture import CastRenderer, PictureRequest, check_size
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.worker import wire
from cellwright.util.errors import CellwrightError, one_line

if TYPE_CHECKING:
    from cellwright.rendering.worker.film import Film


Renderer: TypeAlias = CastRenderer | EngineRenderer

_EXIT_TIMEOUT = 60.0  # [s] after the input has closed


class Drawing:
    """Executes requests in order, and answers each once.

    `make` makes the renderer of a scene.
    """

    def __init__(self, make: Callable[[Scene], Renderer], answers: BinaryIO) -> None:
        self._make = make
        self._answers: BinaryIO | None = answers
        self._renderers: dict[int, Renderer] = {}
        self._film: Film | None = None
        self._last: NDArray[np.uint8] | None = None

    def work(self, requests: SimpleQueue[Any]) -> None:
        """Execute requests until the input closes, and then finish."""
        while (request := requests.get()) is not None:
            number, method, arguments = request
            value, error = None, ""
            try:
                value = getattr(self, f"_do_{method}")(*arguments)
            except CellwrightError as fault:
                error = str(fault)
            except Exception as fault:  # drivers and their wrappers have errors of their own
                error = one_line(fault)
            self._answer(number, value, error)
        try:
            self._do_finish()
        except CellwrightError as error:
            sys.stderr.write(f"{error}\n")

    def _do_scene(self, number: int, scene: Scene) -> str:
        self._renderers[number] = renderer = self._make(scene)
        return renderer.description

    def _do_forget(self, number: int) -> None:
        self._renderers.pop(number, None)

    def _do_colour(self, scene: int, frame: SceneFrame, request: PictureRequest) -> NDArray[np.uint8]:
        return np.ascontiguousarray(self._renderer_for(scene, request).colour(frame, request))

    def _do_depth(self, scene: int, frame: SceneFrame, request: PictureRequest) -> NDArray[np.float32]:
        return np.ascontiguousarray(self._renderer_for(scene, request).depth(frame, request))

    def _do_film(self, file: Path, width: int, height: int, rate: Fraction) -> None:
        from cellwright.rendering.worker.film import Film

        self._film = Film(file, width, height, rate)

    def _do_take(self, frame: SceneFrame, request: PictureRequest, caption: str, repeats: int) -> None:
        if self._film is None:
            raise CellwrightError("no video is open")
        self._repeat(repeats)
        picture = self._do_colour(0, frame, request)
        if caption:
            from cellwright.rendering.worker.lettering import write_line

            write_line(picture, caption)
        self._film.add(picture)
        self._last = picture

    def _do_finish(self, repeats: int = 0) -> int:
        self._repeat(repeats)
        film, self._film = self._film, None
        return 0 if film is None else film.finish()

    def _repeat(self, times: int) -> None:
        """Show the last picture for longer, in place of dropped frames."""
        for _ in range(times):
            if self._film is not None and self._last is not None:
                self._film.add(self._last)

    def _renderer_for(self, scene: int, request: PictureRequest) -> Renderer:
        check_size(request.width, request.height)
        if scene not in self._renderers:
            raise CellwrightError("no scene to draw")
        return self._renderers[scene]

    def _answer(self, number: int, value: object, error: str) -> None:
        if self._answers is None:
            return
        try:
            wire.write(self._answers, (number, value, error))
        except OSError:  # the parent is gone; pending requests are finished all the same
            self._answers = None


def main() -> None:
    """Draw until the input closes."""
    backend, others = _backends(sys.argv[2:])
    make: Callable[[Scene], Renderer] = CastRenderer
    if backend != RAYS:
        try:
            _context, description = open_context(backend)
        except NoOpenGL as reason:
            sys.stderr.write(f"{reason}\n")
            sys.stderr.flush()
            os.execv(sys.executable, wire.command(others))  # noqa: S606 (begins anew, another way)

        def make(scene: Scene) -> Renderer:
            return EngineRenderer(scene, description)

    answers = os.fdopen(os.dup(1), "wb")
    # A driver's prints are no answer.
    os.dup2(2, 1)
    requests: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, requests), daemon=True).start()
    Drawing(make, answers).work(requests)
    sys.stderr.flush()
    # Drivers clean up in an order of their own, and may hang.
    os._exit(0)


def _backends(names: list[str]) -> tuple[str, list[str]]:
    """Backend to use now, and those to try if it fails."""
    if not names:
        requested = requested_backend()
        backends = OPENGL_BACKENDS if requested not in (RAYS, *OPENGL_BACKENDS) else (requested,)
        names = [*(backend for backend in backends if backend != RAYS), RAYS]
    return names[0], names[1:]


def _read(pipe: BinaryIO, requests: SimpleQueue[Any]) -> None:
    """Read requests at once, so that the parent never waits for a picture."""
    while (request := wire.read(pipe)) is not None:
        requests.put(request)
    requests.put(None)
    timer = threading.Timer(_EXIT_TIMEOUT, os._exit, [1])
    timer.daemon = True
    timer.start()
