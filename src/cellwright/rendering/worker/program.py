"""Render process: chooses a backend, draws what it is asked for, and writes videos.

It is told a scene, and then what to draw of it; see `client`. It tries what there is of OpenGL, each way in a program
of its own, for a driver stays loaded once it is, and casts rays in the end. When nobody asks any more, it finishes and
ends.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering import backend as gl
from cellwright.rendering.backend import RAYS, requested_backend
from cellwright.rendering.camera import Camera
from cellwright.rendering.engine_renderer import EngineRenderer
from cellwright.rendering.picture import check_size
from cellwright.rendering.renderer import CastRenderer, Renderer
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.worker import wire
from cellwright.util.errors import CellwrightError, in_a_line

if TYPE_CHECKING:
    from cellwright.rendering.worker.film import Film


class Drawing:
    """Does what is asked, in the order in which it is asked, and answers everything once.

    Args:
        make: makes what draws a scene.
        answers: where answers go.
    """

    def __init__(self, make: Callable[[Scene], Renderer], answers: BinaryIO) -> None:
        self._make = make
        self._answers: BinaryIO | None = answers
        self._scene_renderer: Renderer | None = None
        self._film: Film | None = None
        self._shot: dict[str, Any] = {}
        self._last: NDArray[np.uint8] | None = None

    def work(self, asked: SimpleQueue[Any]) -> None:
        """Do what is asked until nobody asks any more, and then finish."""
        while (said := asked.get()) is not None:
            number, what, arguments, options = said
            value, error = None, ""
            try:
                value = getattr(self, f"_do_{what}")(*arguments, **options)
            except CellwrightError as fault:
                error = str(fault)
            except Exception as fault:  # drivers and what stands before them have errors of their own
                error = in_a_line(fault)
            self._answer(number, value, error)
        try:
            self._do_finish()
        except CellwrightError as error:
            sys.stderr.write(f"{error}\n")

    def _do_scene(self, scene: Scene) -> str:
        self._scene_renderer = self._make(scene)
        return self._scene_renderer.says

    def _do_colour(self, frame: Frame, camera: Camera, width: int, height: int, **quality: Any) -> NDArray[np.uint8]:
        check_size(width, height)
        return np.ascontiguousarray(self._renderer.colour(frame, camera, width, height, **quality))

    def _do_depth(self, frame: Frame, camera: Camera, width: int, height: int) -> NDArray[np.float32]:
        check_size(width, height)
        return np.ascontiguousarray(self._renderer.depth(frame, camera, width, height))

    def _do_film(self, file: Path, rate: Fraction, width: int, height: int, **quality: Any) -> None:
        from cellwright.rendering.worker.film import Film

        self._film = Film(file, width, height, rate)
        self._shot = {"width": width, "height": height, **quality}

    def _do_take(self, frame: Frame, camera: Camera, caption: str, repeats: int) -> None:
        if self._film is None:
            raise CellwrightError("no video is under way")
        self._repeat(repeats)
        picture = self._do_colour(frame, camera, **self._shot)
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
        """Show the last picture for longer, in place of frames that nobody had the time to draw."""
        for _ in range(times):
            if self._film is not None and self._last is not None:
                self._film.add(self._last)

    @property
    def _renderer(self) -> Renderer:
        if self._scene_renderer is None:
            raise CellwrightError("there is no scene to draw")
        return self._scene_renderer

    def _answer(self, number: int, value: object, error: str) -> None:
        if self._answers is None:
            return
        try:
            wire.write(self._answers, (number, value, error))
        except OSError:  # nobody is there to be told any more; what was asked for is done all the same
            self._answers = None


_EXIT_TIMEOUT = 60.0  # [s] after nobody asks any more


def main() -> None:
    """Draw until nobody asks any more."""
    way, later = _ways(sys.argv[2:])
    make: Callable[[Scene], Renderer] = CastRenderer
    if way != RAYS:
        gl.select_platform(way)
        try:
            opened = gl.open_context(way)
        except gl.NoOpenGL as reason:
            sys.stderr.write(f"{reason}\n")
            sys.stderr.flush()
            _become(later)

        def make(scene: Scene) -> Renderer:
            return EngineRenderer(opened, scene)

    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a driver prints is no answer
    asked: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, asked), daemon=True).start()
    Drawing(make, answers).work(asked)
    sys.stderr.flush()
    os._exit(0)  # drivers tidy up in an order of their own, and not always to the end


def _ways(given: list[str]) -> tuple[str, list[str]]:
    """The way to draw now, and those to try if it fails."""
    if not given:
        wanted = requested_backend()
        given = (
            [wanted, RAYS]
            if wanted in gl.OPENGL_BACKENDS
            else [RAYS]
            if wanted == RAYS
            else [*gl.OPENGL_BACKENDS, RAYS]
        )
    return given[0], given[1:]


def _become(ways: list[str]) -> None:
    """Begin anew, another way."""
    os.execv(sys.executable, wire.command(ways))  # noqa: S606


def _read(pipe: BinaryIO, asked: SimpleQueue[Any]) -> None:
    """Take what comes at once, so that whoever asks never waits for a picture to be drawn."""
    while (said := wire.read(pipe)) is not None:
        asked.put(said)
    asked.put(None)
    timer = threading.Timer(_EXIT_TIMEOUT, os._exit, [1])
    timer.daemon = True
    timer.start()
