"""OpenGL renderer of a scene, in colour or in depth, with shadow-mapped light."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL

from cellwright.rendering import shading
from cellwright.rendering import shading as surfaces
from cellwright.rendering.camera import Camera
from cellwright.rendering.gl import shaders
from cellwright.rendering.gl.matrices import Matrix, of_camera, of_sun
from cellwright.rendering.gl.shaders import CORNER, NOTHING, SKY_MAPS, Program
from cellwright.rendering.gl.stage import Part, Stage
from cellwright.rendering.gl.targets import ColourTarget, DepthTarget, ShadowMaps, SmoothedTarget, Target
from cellwright.rendering.picture import LAMP
from cellwright.rendering.scene import SEEN, Frame, Layer, Scene
from cellwright.util.pose import Vector3

_REACH = 6.5
"""How far [m] from the middle of a picture things throw shadows."""
_LAMP_MAP_SIDE, _SKY_SIDE = 2048, 512  # [texels]
_GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
_LAMP_UNIT, _SKY_UNIT = 1, 2  # of textures; 0 says where bodies are


def sky_directions() -> list[Vector3]:
    """Unit vectors towards the sky, spread evenly over it."""
    found: list[Vector3] = []
    for number in range(SKY_MAPS):
        height = (number + 0.5) / SKY_MAPS
        flat, angle = math.sqrt(1 - height * height), number * _GOLDEN_ANGLE
        found.append((flat * math.cos(angle), flat * math.sin(angle), height))
    return found


class Light:
    """Lamp and sky over a stage.

    Args:
        stage: what they shine on.
    """

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._program = Program(CORNER, NOTHING)
        self._lamp_map = ShadowMaps(_LAMP_MAP_SIDE, None)
        self._sky_maps = ShadowMaps(_SKY_SIDE, SKY_MAPS)
        self._place: tuple[Vector3, Vector3] | None = None
        self._lamp_matrix: Matrix = np.eye(4)
        self._sky_matrices: list[Matrix] = []

    def cast(self, lamp: Vector3, centre: Vector3) -> None:
        """Find out what the light reaches, with the bodies where the stage shows them.

        Args:
            lamp: where the lamp is [m].
            centre: the middle [m] of what matters.
        """
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
        GL.glPolygonOffset(1.5, 2.0)
        if self._place != (lamp, centre):
            self._place = lamp, centre
            distance = math.dist(lamp, centre)
            reach = min(_REACH, 0.9 * distance)
            up = (0.0, 0.0, 1.0) if math.hypot(lamp[0] - centre[0], lamp[1] - centre[1]) > 1e-3 else (0.0, 1.0, 0.0)
            seen = Camera(lamp, centre, up, fov=2 * math.asin(reach / distance))
            self._lamp_matrix = of_camera(seen, 1.0, max(0.1, distance - 1.2 * reach), distance + 1.2 * reach)
            self._sky_matrices = [of_sun(direction, centre, reach) for direction in sky_directions()]
            self._lamp_map.draw_still(lambda _: self._draw(self._lamp_matrix, self._stage.still))
            self._sky_maps.draw_still(lambda number: self._draw(self._sky_matrices[number], self._stage.still))
        self._lamp_map.draw_moving(lambda _: self._draw(self._lamp_matrix, self._stage.moving))
        self._sky_maps.draw_moving(lambda number: self._draw(self._sky_matrices[number], self._stage.large))
        GL.glDisable(GL.GL_POLYGON_OFFSET_FILL)

    def shine(self, program: Program) -> None:
        """Have a program use what was found out."""
        self._lamp_map.bind(_LAMP_UNIT)
        self._sky_maps.bind(_SKY_UNIT)
        program.use(
            lamp_T_world=self._lamp_matrix,
            sky_T_world=np.array(self._sky_matrices),
            sky_direction=np.array(sky_directions()),
            lamp_offset=2.0 * 2 * _REACH / _LAMP_MAP_SIDE,
            sky_offset=1.5 * 2 * _REACH / _SKY_SIDE,
        )

    def _draw(self, matrix: Matrix, part: Part) -> None:
        self._program.use(clip_T_world=matrix, bodies=0)
        part.draw()


def bind_units(program: Program) -> None:
    """Say which textures a program looks things up in; each kind has one of its own, also where none is used."""
    program.use(bodies=0, lamp_map=_LAMP_UNIT, sky_maps=_SKY_UNIT)


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
