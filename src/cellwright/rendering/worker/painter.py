"""A painter that has a process draw for it."""

from __future__ import annotations

from numpy import float32, uint8
from numpy.typing import NDArray

from cellwright.rendering.painter import Drawn, View
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.worker.client import RenderWorker
from cellwright.rendering.worker.pending import Pending
from cellwright.util.pose import Vector3

_TIME_TO_END = 0.5  # [s]


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
        self._worker.close(_TIME_TO_END)
