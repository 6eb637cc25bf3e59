"""A painter that casts rays, in a thread of its own: it needs nothing of the machine, and is slow."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from cellwright.pose import Pose
from cellwright.rendering.camera import Camera
from cellwright.rendering.edges import pixel_points
from cellwright.rendering.painter import Drawn
from cellwright.rendering.picture import render
from cellwright.rendering.pinhole import Pinhole
from cellwright.rendering.raycast import RayCaster
from cellwright.scene.frame import Frame
from cellwright.scene.model import SceneModel
from cellwright.scene.scene import Scene


class RayPainter:
    """Draws one scene; see `Painter`.

    Args:
        scene: what there is to be seen.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._model: SceneModel | None = None
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="painter")
        self._asked = 0
        self._pictures: dict[int, Future[Drawn]] = {}

    def submit(self, frame: Frame, pinhole: Pinhole, world_T_camera: Pose, *, colour: bool, depth: bool) -> int:
        """Ask for a picture; returns its number."""
        self._asked += 1
        self._pictures[self._asked] = self._thread.submit(
            self._draw, frame, pinhole, world_T_camera, colour=colour, depth=depth
        )
        return self._asked

    def is_drawn(self, number: int) -> bool:
        """Whether a picture is there."""
        return self._pictures[number].done()

    def fetch(self, number: int) -> Drawn:
        """The picture; waits for it. It is gone then."""
        return self._pictures.pop(number).result()

    def forget(self, number: int) -> None:
        """A picture that was asked for is not wanted any more."""
        if (picture := self._pictures.pop(number, None)) is not None:
            picture.cancel()

    def close(self) -> None:
        """Nothing more is to be drawn."""
        self._thread.shutdown(cancel_futures=True)

    def _draw(self, frame: Frame, pinhole: Pinhole, world_T_camera: Pose, *, colour: bool, depth: bool) -> Drawn:
        if self._model is None:
            self._model = SceneModel(self._scene)
        self._model.show(frame)
        camera, model = pinhole.at(world_T_camera), self._model
        return Drawn(
            render(model.model, model.data, camera, pinhole.width, pinhole.height, samples=1) if colour else None,
            _depth(model, camera, pinhole) if depth else None,
        )


def _depth(model: SceneModel, camera: Camera, pinhole: Pinhole) -> NDArray[np.float32]:
    """Depths (height, width) [m] along the line of sight, infinite where there is nothing."""
    size = (pinhole.width, pinhole.height)
    directions = camera.directions(pixel_points(np.arange(size[0] * size[1]), size[0], samples=1), *size)
    hits = RayCaster(model.model, model.data).cast(np.asarray(camera.eye), directions)
    ahead = directions @ camera.world_R_optical[:, 2]
    return (hits.distance * ahead).astype(np.float32).reshape(size[1], size[0])
