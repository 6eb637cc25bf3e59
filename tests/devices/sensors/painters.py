"""A painter for tests that draws when it is told to."""

from __future__ import annotations

import numpy as np

from cellwright.errors import RenderingError
from cellwright.pose import Pose
from cellwright.rendering.painter import Drawn
from cellwright.rendering.pinhole import Pinhole
from cellwright.scene.frame import Frame
from cellwright.scene.scene import Scene


class FakePainter:
    """Pictures of one colour and one depth: the time of the frame in ms, and what the camera's x is [m]."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.is_quick = True
        self.has_begun = True
        self.is_broken = False
        self.is_closed = False
        self.asked: dict[int, tuple[Frame, Pinhole, Pose, bool, bool]] = {}
        self.forgotten: list[int] = []
        self.count = 0

    def submit(self, frame: Frame, pinhole: Pinhole, world_T_camera: Pose, *, colour: bool, depth: bool) -> int:
        if self.is_broken:
            raise RenderingError("the brush is broken")
        self.count += 1
        self.asked[self.count] = (frame, pinhole, world_T_camera, colour, depth)
        return self.count

    @property
    def is_ready(self) -> bool:
        return self.has_begun

    def is_drawn(self, number: int) -> bool:
        return self.is_quick

    def fetch(self, number: int) -> Drawn:
        if self.is_broken:
            raise RenderingError("the brush is broken")
        frame, pinhole, pose, colour, depth = self.asked.pop(number)
        size = (pinhole.height, pinhole.width)
        return Drawn(
            np.full((*size, 3), frame.time // 1_000_000 % 256, np.uint8) if colour else None,
            np.full(size, pose.position[0], np.float32) if depth else None,
        )

    def forget(self, number: int) -> None:
        if self.asked.pop(number, None) is not None:
            self.forgotten.append(number)

    def close(self) -> None:
        self.is_closed = True
