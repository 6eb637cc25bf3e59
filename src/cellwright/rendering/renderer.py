"""What draws scenes: by OpenGL where there is any, else by casting rays."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import LAMP, render
from cellwright.rendering.raycast import RayCaster
from cellwright.rendering.scene import Frame, Scene
from cellwright.rendering.scene.engine import EngineScene
from cellwright.util.pose import Vector3


class Renderer(Protocol):
    """Draws one scene, over and over."""

    says: str
    """What it draws with, for those who want to know."""

    def colour(
        self,
        frame: Frame,
        camera: Camera,
        width: int,
        height: int,
        *,
        samples: int,
        shadows: bool,
        about: Vector3 | None = None,
        lamp: Vector3 = LAMP,
    ) -> NDArray[np.uint8]:
        """A picture (height, width, 3), sRGB.

        Args:
            frame: where the bodies are.
            camera: where it is seen from.
            width: in pixels.
            height: in pixels.
            samples: along each side of a pixel at edges, so that they are smooth; 1 leaves them jagged.
            shadows: whether light is held off by what stands in its way, for those who can do without.
            about: the point [m] that the lamp is placed by, so that cameras that move, or are several, are in one
                light; None takes the one that the camera looks at.
            lamp: where the light comes from [m], from that point, along the axes of the world.
        """
        ...

    def depth(self, frame: Frame, camera: Camera, width: int, height: int) -> NDArray[np.float32]:
        """How far [m] what is seen at each pixel is (height, width), along the camera's line of sight.

        Infinite where nothing is. Translucent things count as if they were not.
        """
        ...


class CastRenderer:
    """Draws a scene by casting rays: slow, and possible everywhere.

    Args:
        scene: what is to be seen.
    """

    def __init__(self, scene: Scene) -> None:
        self.says = RAYS
        self._scene = EngineScene(scene)

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
        lamp: Vector3 = LAMP,
    ) -> NDArray[np.uint8]:
        """See `Renderer`; shadows are always there."""
        del shadows
        self._scene.show(frame)
        ax, ay, az = np.subtract(lamp, np.subtract(camera.target, camera.target if about is None else about)).tolist()
        return render(self._scene.model, self._scene.data, camera, width, height, samples=samples, lamp=(ax, ay, az))

    def depth(self, frame: Frame, camera: Camera, width: int, height: int) -> NDArray[np.float32]:
        """See `Renderer`."""
        self._scene.show(frame)
        rows, columns = np.mgrid[0:height, 0:width] + 0.5
        directions = camera.directions(np.column_stack([columns.reshape(-1), rows.reshape(-1)]), width, height)
        hits = RayCaster(self._scene.model, self._scene.data).cast(
            np.array(camera.eye, np.float64), directions, through_translucent=True
        )
        along = directions @ camera.world_R_optical[:, 2]
        return (hits.distance * along).reshape(height, width).astype(np.float32)
