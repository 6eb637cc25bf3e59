"""A painter for tests that draws when it is told to."""

from __future__ import annotations

import numpy as np

from cellwright.rendering.painter import Drawn, View
from cellwright.rendering.scene.scene import Frame, Scene
from cellwright.util.errors import RenderingError


class FakePainter:
    """Pictures of one colour and one depth: the time of the frame in ms, and what the camera's x is [m]."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.is_quick = True
        self.has_begun = True
        self.is_broken = False
        self.is_closed = False
        self.asked: dict[int, tuple[Frame, View]] = {}
        self.forgotten: list[int] = []
        self.count = 0

    def submit(self, frame: Frame, view: View) -> int:
        if self.is_broken:
            raise RenderingError("the brush is broken")
        self.count += 1
        self.asked[self.count] = (frame, view)
        return self.count

    @property
    def is_ready(self) -> bool:
        return self.has_begun

    def is_drawn(self, number: int) -> bool:
        return self.is_quick

    def fetch(self, number: int) -> Drawn:
        if self.is_broken:
            raise RenderingError("the brush is broken")
        frame, view = self.asked.pop(number)
        size = (view.pinhole.height, view.pinhole.width)
        return Drawn(
            np.full((*size, 3), frame.time // 1_000_000 % 256, np.uint8) if view.colour else None,
            np.full(size, view.world_T_camera.position[0], np.float32) if view.depth else None,
        )

    def forget(self, number: int) -> None:
        if self.asked.pop(number, None) is not None:
            self.forgotten.append(number)

    def close(self) -> None:
        self.is_closed = True
