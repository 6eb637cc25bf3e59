"""The process that draws.

It is told a scene, and then what to draw of it; see `client`. It tries what there is of OpenGL, each way in a program
of its own, for a driver stays loaded once it is, and casts rays in the end. When nobody asks any more, it finishes and
ends.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, BinaryIO

from cellwright.rendering.gl import context as gl
from cellwright.rendering.renderer import CastRenderer, Renderer
from cellwright.rendering.scene import Scene
from cellwright.rendering.way import RAYS, settled_way
from cellwright.rendering.worker import wire
from cellwright.rendering.worker.drawing import Drawing

_TIME_TO_END = 60.0  # [s] after nobody asks any more


def main() -> None:
    """Draw until nobody asks any more."""
    way, later = _ways(sys.argv[2:])
    make: Callable[[Scene], Renderer] = CastRenderer
    if way != RAYS:
        gl.choose(way)
        try:
            opened = gl.open_context(way)
        except gl.NoOpenGL as reason:
            sys.stderr.write(f"{reason}\n")
            sys.stderr.flush()
            _become(later)

        def make(scene: Scene) -> Renderer:
            from cellwright.rendering.gl.renderer import GLRenderer

            return GLRenderer(opened, scene)

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
        wanted = settled_way()
        given = [wanted, RAYS] if wanted in gl.WAYS else [RAYS] if wanted == RAYS else [*gl.WAYS, RAYS]
    return given[0], given[1:]


def _become(ways: list[str]) -> None:
    """Begin anew, another way."""
    os.execv(sys.executable, wire.command(ways))  # noqa: S606


def _read(pipe: BinaryIO, asked: SimpleQueue[Any]) -> None:
    """Take what comes at once, so that whoever asks never waits for a picture to be drawn."""
    while (said := wire.read(pipe)) is not None:
        asked.put(said)
    asked.put(None)
    timer = threading.Timer(_TIME_TO_END, os._exit, [1])
    timer.daemon = True
    timer.start()
