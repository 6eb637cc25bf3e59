"""Render process client: starts the process, sends frames, and returns pictures when they are ready."""

from __future__ import annotations

import os
import subprocess
import tempfile
import threading
from collections.abc import Mapping
from contextlib import suppress
from types import TracebackType
from typing import Any, Generic, TypeVar, cast

import numpy as np
from numpy import float32, uint8
from numpy.typing import NDArray

from cellwright.rendering.backend import requested_backend
from cellwright.rendering.camera import Camera
from cellwright.rendering.painter import Drawn, View
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.scene.scene import encode_scene
from cellwright.rendering.worker import wire
from cellwright.util.errors import RenderingError, showable
from cellwright.util.pose import Vector3

T = TypeVar("T")


class Pending(Generic[T]):
    """Something that will be there later."""

    def __init__(self) -> None:
        self._event = threading.Event()
        self._value: Any = None
        self._error = ""

    @property
    def is_done(self) -> bool:
        """Whether it is there, or has failed."""
        return self._event.is_set()

    def result(self, timeout: float | None = None) -> T:
        """What was asked for, waiting for it at most so long [s].

        Raises:
            RenderingError: it could not be made, or is not there in time.
        """
        if not self._event.wait(timeout):
            raise RenderingError(f"what draws has not answered within {timeout:g} s")
        if self._error:
            raise RenderingError(self._error)
        return cast("T", self._value)

    def settle(self, value: Any, error: str = "") -> None:
        """Say what has come of it."""
        self._value, self._error = value, error
        self._event.set()


_CLOSE_TIMEOUT = 20.0  # [s], for what was asked for last


class RenderWorker:
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
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the process)
        self._process = subprocess.Popen(  # noqa: S603 (this program, with an argument of ours)
            wire.command(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env=_environment(os.environ),
            start_new_session=True,  # a Ctrl-C on the terminal is for the one who asked
        )
        self._waiting: dict[int, Pending[Any]] = {}
        self._changed = threading.Condition()
        self._number = 0
        self._is_closing = False
        self._reader = threading.Thread(target=self._read, name="pictures", daemon=True)
        self._reader.start()
        self.ready: Pending[str] = self.ask({"what": "scene"}, encode_scene(scene))
        """What it draws with, in words, once that is known."""

    @property
    def waiting(self) -> int:
        """How many things it has been asked for and not done yet."""
        return len(self._waiting)

    @property
    def has_room(self) -> bool:
        """Whether it can be asked for more before it has caught up."""
        return len(self._waiting) < self._most

    def wait_for_room(self, timeout: float | None = None) -> bool:
        """Wait until it can be asked for more, at most so long [s]; whether it can."""
        with self._changed:
            return self._changed.wait_for(lambda: self.has_room, timeout)

    def colour(
        self,
        frame: Frame,
        camera: Camera,
        width: int,
        height: int,
        *,
        samples: int = 2,
        shadows: bool = True,
        about: Vector3 | None = None,
    ) -> Pending[NDArray[np.uint8]]:
        """Ask for a picture (height, width, 3), sRGB; see `Renderer.colour`."""
        size = {"what": "colour", "width": width, "height": height}
        quality = {"samples": samples, "shadows": shadows, "about": about}
        return self.ask({**size, **quality, "camera": wire.of_camera(camera)}, frame.encode())

    def depth(self, frame: Frame, camera: Camera, width: int, height: int) -> Pending[NDArray[np.float32]]:
        """Ask for how far [m] everything is (height, width); see `Renderer.depth`."""
        about = {"what": "depth", "width": width, "height": height}
        return self.ask({**about, "camera": wire.of_camera(camera)}, frame.encode())

    def ask(self, head: dict[str, Any], payload: bytes = b"") -> Pending[Any]:
        """Ask for something; one that has ended fails it."""
        pending: Pending[Any] = Pending()
        with self._changed:
            if self.error or self._is_closing:
                pending.settle(None, self.error or "what draws is closed")
                return pending
            self._number += 1
            number = self._number
            self._waiting[number] = pending
        with suppress(OSError, ValueError):  # it has ended, and the thread that reads says why
            wire.write(self._stdin, {**head, "number": number}, payload)
        return pending

    def close(self, timeout: float = _CLOSE_TIMEOUT) -> None:
        """Have it finish what it was asked for, within a time [s], and end."""
        with self._changed:
            self._is_closing = True
        with suppress(OSError):
            self._stdin.close()
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self._log.close()

    def __enter__(self) -> RenderWorker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def _stdin(self) -> Any:
        return self._process.stdin

    def _read(self) -> None:
        stdout: Any = self._process.stdout
        try:
            while (said := wire.read(stdout)) is not None:
                self._take(*said)
        except (OSError, ValueError):
            pass  # no sense can be made of it: as if it had ended
        self._over()

    def _take(self, head: Mapping[str, Any], payload: bytes) -> None:
        with self._changed:
            pending = self._waiting.pop(head["number"])
            self._changed.notify_all()
        value: Any = head.get("value")
        if "shape" in head:
            value = np.frombuffer(payload, head["kind"]).reshape(head["shape"])
        pending.settle(value, head.get("error", ""))

    def _over(self) -> None:
        with self._changed:
            if not self._is_closing or self._waiting:
                self.error = f"the process that draws has ended{self._last_words()}"
            left = [*self._waiting.values()]
            self._waiting.clear()
            self._changed.notify_all()
        for pending in left:
            pending.settle(None, self.error)

    def _last_words(self) -> str:
        try:
            self._log.seek(0)
            lines = self._log.read()[-2000:].decode(errors="replace").split("\n")
        except (OSError, ValueError):
            return ""
        said = [line.strip() for line in lines if line.strip()]
        return f": {showable(said[-1], 300)}" if said else ""


def _environment(own: Mapping[str, str]) -> dict[str, str]:
    """That of this process, but for what settles how the engine and others draw: the program does that itself."""
    kept = {name: value for name, value in own.items() if name not in ("PYOPENGL_PLATFORM", "DISPLAY")}
    return {**kept, "MUJOCO_GL": "disable"}


_ABANDON_TIMEOUT = 0.5  # [s]


class WorkerPainter:
    """Draws one scene; see `Painter`.

    Args:
        scene: what there is to be seen.
        about: the point [m] that the lamp is placed by.
    """

    def __init__(self, scene: Scene, *, about: Vector3 = (0.0, 0.0, 0.0)) -> None:
        self._about = about
        self._worker = RenderWorker(scene)
        self._asked = 0
        self._pictures: dict[int, tuple[Pending[NDArray[uint8]] | None, Pending[NDArray[float32]] | None]] = {}

    @property
    def is_ready(self) -> bool:
        """Whether the process has begun to draw."""
        return self._worker.ready.is_done

    def submit(self, frame: Frame, view: View) -> int:
        """Ask for a picture; returns its number."""
        camera, size = view.pinhole.at(view.world_T_camera), (view.pinhole.width, view.pinhole.height)
        worker = self._worker
        self._asked += 1
        self._pictures[self._asked] = (
            worker.colour(frame, camera, *size, samples=1, shadows=view.shadows, about=self._about)
            if view.colour
            else None,
            worker.depth(frame, camera, *size) if view.depth else None,
        )
        return self._asked

    def is_drawn(self, number: int) -> bool:
        """Whether a picture is there, or will never be."""
        return all(pending is None or pending.is_done for pending in self._pictures[number])

    def fetch(self, number: int) -> Drawn:
        """The picture; waits for it. It is gone then.

        Raises:
            RenderingError: it could not be drawn.
        """
        colour, depth = self._pictures.pop(number)
        return Drawn(None if colour is None else colour.result(), None if depth is None else depth.result())

    def forget(self, number: int) -> None:
        """A picture that was asked for is not wanted any more."""
        self._pictures.pop(number, None)

    def close(self) -> None:
        """Let the process end; pictures that nobody has fetched are not drawn any more."""
        self._pictures.clear()
        self._worker.close(_ABANDON_TIMEOUT)
