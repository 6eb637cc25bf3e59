"""Render service: draws the pictures of all of a cell's cameras in the render process of this process's cells.

A camera requests a picture in one tick and fetches it in a later one; physics continues meanwhile. The picture depends
only on the frame of the tick of its request.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.simulation import Simulation
from cellwright.rendering.camera import Camera, Pinhole
from cellwright.rendering.picture import PictureRequest
from cellwright.rendering.scene.scene import Scene, SceneFrame
from cellwright.util.errors import RenderingError
from cellwright.util.pose import Pose, Vector3

if TYPE_CHECKING:
    from cellwright.rendering.scene.engine import SceneCapture
    from cellwright.rendering.worker.client import RenderWorker
    from cellwright.rendering.worker.shared import SharedRenderer

_ABANDON_TIMEOUT = 0.5  # [s]


Drawn: TypeAlias = tuple[NDArray[np.uint8] | None, NDArray[np.float32] | None]
"""Colours (height, width, 3), sRGB, and depths (height, width) [m] along the line of sight, each if requested.

Depths are infinite where there is nothing, and have no noise."""


@dataclass(frozen=True, slots=True)
class PendingPicture:
    """Requested picture: futures of its colours and its depths, each if requested."""

    colour: Future[NDArray[np.uint8]] | None
    depth: Future[NDArray[np.float32]] | None

    @property
    def is_drawn(self) -> bool:
        """True if it is ready, or has failed."""
        return all(each is None or each.done() for each in (self.colour, self.depth))


def share_worker(scene: Scene) -> SharedRenderer:
    """Return a renderer of a scene in the process that all cells share."""
    from cellwright.rendering.worker.shared import SharedRenderer  # not loaded by a plain run

    return SharedRenderer(scene)


class RenderService:
    """Render service for the frames of a simulation.

    Args:
        capture: makes the capture of the simulation's scene; called for the first picture.
        start: returns a renderer in another process; called for the first picture.
        about: point [m] from which the lamp is placed.
        report: receives a line when drawing has failed for good.
    """

    def __init__(
        self,
        simulation: Simulation,
        capture: Callable[[], SceneCapture],
        start: Callable[[Scene], RenderWorker | SharedRenderer] = share_worker,
        *,
        about: Vector3,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self._simulation = simulation
        self._start = start
        self._about = about
        self._report = report
        self._make_capture = capture
        self._capture: SceneCapture | None = None
        self._worker: RenderWorker | SharedRenderer | None = None
        self._frame: SceneFrame | None = None
        self._tick = -1
        self._is_broken = False

    def ask(
        self, pinhole: Pinhole, world_T_camera: Pose, *, colour: bool, depth: bool, shadows: bool = True
    ) -> PendingPicture | None:
        """Request a picture of this tick; return None if nothing can be drawn."""
        camera = pinhole.at(world_T_camera)
        return self.ask_view(camera, (pinhole.width, pinhole.height), colour=colour, depth=depth, shadows=shadows)

    def ask_view(
        self, camera: Camera, size: tuple[int, int], *, colour: bool = True, depth: bool = False, shadows: bool = True
    ) -> PendingPicture | None:
        """Request a picture of this tick from any place, by width and height in pixels; as `ask` otherwise."""
        if self._is_broken:
            return None
        if self._capture is None:
            self._capture = self._make_capture()
        if self._worker is None:
            self._worker = worker = self._start(self._capture.scene)
            # for a cell that is not closed, too; pictures that are not fetched delay nothing
            self._end = weakref.finalize(self, worker.close, _ABANDON_TIMEOUT)
        frame, worker = self._this_frame(self._capture), self._worker
        request = PictureRequest(camera, *size, samples=1, shadows=shadows, about=self._about)
        return PendingPicture(
            worker.colour(frame, request) if colour else None, worker.depth(frame, request) if depth else None
        )

    @property
    def is_ready(self) -> bool:
        """True once the render process draws."""
        return self._worker is not None and self._worker.ready.done()

    @property
    def backend(self) -> str:
        """Name of the renderer of the render process, once that is known; empty before its start."""
        return "" if self._worker is None else self._worker.ready.result()

    def fetch(self, pending: PendingPicture) -> Drawn | None:
        """Wait for a requested picture, and return it; None if drawing failed."""
        try:
            colour = None if pending.colour is None else pending.colour.result()
            return colour, None if pending.depth is None else pending.depth.result()
        except RenderingError as error:
            self._give_up(error)
            return None

    def reopen(self) -> None:
        """Try again with another process after a failure; called when a run begins."""
        self._is_broken = False
        self._tick = -1

    def close(self) -> None:
        """Release the process once it has drawn all that was asked; the next picture starts another one."""
        if self._worker is not None:
            self._end.detach()
            self._worker.close()
            self._worker = None

    def _this_frame(self, capture: SceneCapture) -> SceneFrame:
        """Frame of this tick, shared by its cameras."""
        simulation = self._simulation
        simulation.refresh()
        if self._frame is None or self._tick != simulation.clock.tick:
            self._frame = capture.frame(simulation.data, simulation.now)
            self._tick = simulation.clock.tick
        return self._frame

    def _give_up(self, error: RenderingError) -> None:
        if not self._is_broken:
            self._is_broken = True
            self._report(f"cameras are off for the rest of this run: {error}")
            self.close()
