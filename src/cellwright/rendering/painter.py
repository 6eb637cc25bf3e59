"""Who draws pictures of a scene while others go on: what they are asked, and what they give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Pinhole
from cellwright.rendering.scene.scene import Frame
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture as it was drawn, without noise.

    Attributes:
        colour: (height, width, 3) sRGB, if it was asked for.
        depth: (height, width) [m] along the line of sight, infinite where there is nothing; if it was asked for.
    """

    colour: NDArray[np.uint8] | None
    depth: NDArray[np.float32] | None


@dataclass(frozen=True, slots=True)
class View:
    """What is to be drawn of a frame.

    Attributes:
        pinhole: the camera.
        world_T_camera: where it stands.
        colour: whether in colour.
        depth: whether in depth.
        shadows: whether things throw shadows where it is in colour.
    """

    pinhole: Pinhole
    world_T_camera: Pose
    colour: bool
    depth: bool
    shadows: bool = True


class Painter(Protocol):
    """Draws one scene."""

    def submit(self, frame: Frame, view: View) -> int:
        """Ask for a picture; returns its number.

        Raises:
            RenderingError: nothing can be drawn.
        """

    @property
    def is_ready(self) -> bool:
        """Whether it has begun to work; before, a picture takes longer than later ones."""

    def is_drawn(self, number: int) -> bool:
        """Whether a picture is there, or will never be."""

    def fetch(self, number: int) -> Drawn:
        """The picture; waits for it. It is gone then.

        Raises:
            RenderingError: it could not be drawn.
        """

    def forget(self, number: int) -> None:
        """A picture that was asked for is not wanted any more."""

    def close(self) -> None:
        """Nothing more is to be drawn."""
