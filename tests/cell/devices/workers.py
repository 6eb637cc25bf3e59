"""Render worker for tests that draws on request."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import PictureRequest
from cellwright.rendering.scene.scene import Scene, SceneFrame
from cellwright.rendering.worker import RenderWorker
from cellwright.util.errors import RenderingError


class FakeWorker(RenderWorker):
    """Render worker whose pictures have one colour, the time of the frame in ms, and one depth, the camera's x [m].

    Attributes:
        asked: frame, camera and kinds of each picture.
        fetched: numbers of those that were fetched, from 1.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.is_quick = True
        self.has_begun = True
        self.is_broken = False
        self.is_closed = False
        self.asked: list[tuple[SceneFrame, Camera, list[str]]] = []
        self.fetched: list[int] = []
        self.ready = _Ready(self)

    @property
    def count(self) -> int:
        """Number of requested pictures."""
        return len(self.asked)

    def colour(self, frame: SceneFrame, request: PictureRequest, scene: int = 0) -> Future[NDArray[np.uint8]]:
        self.asked.append((frame, request.camera, ["colour"]))
        return _Picture(self, np.full((request.height, request.width, 3), frame.time // 1_000_000 % 256, np.uint8))

    def depth(self, frame: SceneFrame, request: PictureRequest, scene: int = 0) -> Future[NDArray[np.float32]]:
        camera = request.camera
        if self.asked and self.asked[-1] == (frame, camera, ["colour"]):
            self.asked[-1][2].append("depth")
        else:
            self.asked.append((frame, camera, ["depth"]))
        return _Picture(self, np.full((request.height, request.width), camera.eye[0], np.float32))

    def close(self, timeout: float = 0.0) -> None:
        self.is_closed = True


class _Picture(Future[Any]):
    def __init__(self, worker: FakeWorker, picture: NDArray[Any]) -> None:
        super().__init__()
        self._worker, self._picture, self._number = worker, picture, worker.count

    def done(self) -> bool:
        return self._worker.is_quick

    def result(self, timeout: float | None = None) -> Any:
        if self._worker.is_broken:
            raise RenderingError("the brush is broken")
        if self._number not in self._worker.fetched:
            self._worker.fetched.append(self._number)
        return self._picture


class _Ready(Future[str]):
    def __init__(self, worker: FakeWorker) -> None:
        super().__init__()
        self._worker = worker

    def done(self) -> bool:
        return self._worker.has_begun
