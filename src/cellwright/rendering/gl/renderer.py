"""Draws a scene by OpenGL, in colour or in depth."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from cellwright.rendering import shading, surfaces
from cellwright.rendering.camera import Camera
from cellwright.rendering.gl import shaders
from cellwright.rendering.gl.light import Light, bind_units
from cellwright.rendering.gl.matrices import Matrix, of_camera
from cellwright.rendering.gl.program import Program
from cellwright.rendering.gl.stage import Stage
from cellwright.rendering.gl.targets import ColourTarget, DepthTarget, SmoothedTarget, Target
from cellwright.rendering.picture import LAMP
from cellwright.rendering.scene import SEEN, Frame, Layer, Scene
from cellwright.util.pose import Vector3

_NEAR, _FAR = 0.02, 200.0  # [m]
_MOST_TARGETS = 8  # sizes of pictures that memory is kept for

_Size = TypeVar("_Size", bound=tuple[int, ...])
_Target = TypeVar("_Target", bound=Target)


class GLRenderer:
    """Draws a scene by OpenGL, in the thread that made it; see `Renderer`.

    Args:
        context: what it draws with, current in this thread; see `open_context`.
        scene: what is to be seen.
        layers: which of its shapes.

    Raises:
        NoOpenGL: this OpenGL cannot do what is needed.
    """

    def __init__(self, context: Any, scene: Scene, *, layers: Collection[Layer] = SEEN) -> None:
        self._context = context
        self.says = f"{_said(GL.GL_RENDERER)}, OpenGL {_said(GL.GL_VERSION)}"
        """What draws, for those who want to know."""
        self._stage = Stage(scene, layers)
        pixel, behind = shaders.with_figures(_figures())
        self._surface = Program(shaders.CORNER, pixel)
        self._behind = Program(shaders.BEHIND_CORNER, behind)
        self._depth = Program(shaders.CORNER, shaders.DEPTH)
        self._first = Program(shaders.CORNER, shaders.NOTHING)
        self._light = Light(self._stage)
        self._lit: tuple[tuple[Vector3, Vector3], Frame] | None = None  # where the light was, and what it fell on
        self._colours: dict[tuple[int, int, int], ColourTarget | SmoothedTarget] = {}
        self._depths: dict[tuple[int, int], DepthTarget] = {}

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
        """See `Renderer`.

        Of `samples` 2 has edges smoothed afterwards; more have four drawn of each pixel, which costs more than all
        else.
        """
        about = camera.target if about is None else about
        x, y, z = about
        at = (x + lamp[0], y + lamp[1], z + lamp[2])
        self._stage.show(frame)
        if shadows:
            self._cast_light(frame, at, about)
        target = self._colour_target(width, height, samples)
        target.begin()
        seen = of_camera(camera, width / height, _NEAR, _FAR)
        GL.glEnable(GL.GL_DEPTH_TEST)
        # first how far everything is, so that the costly colours are found for what is seen alone
        GL.glDepthFunc(GL.GL_LESS)
        GL.glColorMask(False, False, False, False)
        self._first.use(clip_T_world=seen, bodies=0)
        self._stage.opaque.draw()
        GL.glColorMask(True, True, True, True)
        GL.glDepthFunc(GL.GL_LEQUAL)
        self._behind.use(world_T_clip=_directions(camera, width / height))
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        self._surface.use(clip_T_world=seen, eye=camera.eye, lamp=at, has_shadows=int(shadows))
        bind_units(self._surface)
        if shadows:
            self._light.shine(self._surface)
        self._stage.opaque.draw()
        if self._stage.glass.count:
            GL.glEnable(GL.GL_BLEND)
            GL.glBlendFunc(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA)
            GL.glDepthMask(False)
            self._stage.glass.draw()
            GL.glDepthMask(True)
            GL.glDisable(GL.GL_BLEND)
        GL.glDepthFunc(GL.GL_LESS)
        return target.read()

    def _colour_target(self, width: int, height: int, samples: int) -> ColourTarget | SmoothedTarget:
        def make() -> ColourTarget | SmoothedTarget:
            if samples == 2:
                return SmoothedTarget(width, height)
            return ColourTarget(width, height, 4 if samples > 2 else 1)

        return _kept(self._colours, (width, height, min(samples, 3)), make)

    def _cast_light(self, frame: Frame, lamp: Vector3, about: Vector3) -> None:
        """Find out what the light reaches, unless that was done last: several cameras may look at one moment."""
        lit, place = self._lit, (lamp, about)
        if (
            lit is not None
            and lit[0] == place
            and np.array_equal(lit[1].poses, frame.poses)
            and np.array_equal(lit[1].shown, frame.shown)
        ):
            return
        self._light.cast(lamp, about)
        self._lit = (place, frame)

    def depth(self, frame: Frame, camera: Camera, width: int, height: int) -> NDArray[np.float32]:
        """See `Renderer`."""
        self._stage.show(frame)
        target = _kept(self._depths, (width, height), lambda: DepthTarget(width, height))
        target.begin()
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glDepthFunc(GL.GL_LESS)
        self._depth.use(
            clip_T_world=of_camera(camera, width / height, _NEAR, _FAR),
            bodies=0,
            eye=camera.eye,
            forward=camera.world_R_optical[:, 2],
        )
        self._stage.opaque.draw()
        return target.read()


def _kept(targets: dict[_Size, _Target], size: _Size, make: Callable[[], _Target]) -> _Target:
    """What is drawn into at a size; of too many sizes the one that was made first is given up."""
    if size not in targets:
        if len(targets) >= _MOST_TARGETS:
            targets.pop(next(iter(targets))).free()
        targets[size] = make()
    return targets[size]


def _directions(camera: Camera, aspect: float) -> Matrix:
    """From a place in the picture (clip coordinates of x and y, 1, 1) to a direction in the world."""
    slope = float(np.tan(camera.fov / 2))
    matrix = np.eye(4)
    matrix[:3, :3] = camera.world_R_optical @ np.diag([slope * aspect, slope, 1.0])
    return matrix


def _figures() -> dict[str, str]:
    low, high = shading.SHARPNESS
    return {
        "SKY_MAPS": str(shaders.SKY_MAPS),
        "KEY": _vector(shading.KEY),
        "SKY": _vector(shading.SKY),
        "GROUND": _vector(shading.GROUND),
        "BURIED": _number(shading.BURIED),
        "HIGHLIGHT": _number(shading.HIGHLIGHT * surfaces.PLASTIC_SPECULAR),
        "SHARPNESS": _number(low + (high - low) * surfaces.PLASTIC_SHININESS),
        "HORIZON": _vector(shading.HORIZON),
        "ZENITH": _vector(shading.ZENITH),
        "HAZE_START": _number(shading.HAZE_START),
        "HAZE_END": _number(shading.HAZE_END),
        "KNEE": _number(shading.KNEE),
        "TILE": _number(surfaces.TILE),
        "LINE": _number(surfaces.LINE),
        "LINE_SHADE": _number(surfaces.LINE_SHADE),
    }


def _number(value: float) -> str:
    return f"{value:.8f}"


def _vector(value: NDArray[np.float32]) -> str:
    return f"vec3({', '.join(_number(float(each)) for each in value)})"


def _said(name: int) -> str:
    said = GL.glGetString(name)
    return said.decode(errors="replace") if isinstance(said, bytes) else str(said)
