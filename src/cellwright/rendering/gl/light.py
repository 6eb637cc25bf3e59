"""The light that falls on a scene: one lamp, and a sky of several directions, each with a map of what it reaches."""

from __future__ import annotations

import math

import numpy as np
from OpenGL import GL

from cellwright.rendering.camera import Camera
from cellwright.rendering.gl.matrices import Matrix, of_camera, of_sun
from cellwright.rendering.gl.program import Program
from cellwright.rendering.gl.shaders import CORNER, NOTHING, SKY_MAPS
from cellwright.rendering.gl.shadow_maps import ShadowMaps
from cellwright.rendering.gl.stage import Part, Stage
from cellwright.util.pose import Vector3

_REACH = 6.5
"""How far [m] from the middle of a picture things throw shadows."""
_LAMP_SIDE, _SKY_SIDE = 2048, 512  # [texels]
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
        self._lamp_map = ShadowMaps(_LAMP_SIDE, None)
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
            lamp_offset=2.0 * 2 * _REACH / _LAMP_SIDE,
            sky_offset=1.5 * 2 * _REACH / _SKY_SIDE,
        )

    def _draw(self, matrix: Matrix, part: Part) -> None:
        self._program.use(clip_T_world=matrix, bodies=0)
        part.draw()


def bind_units(program: Program) -> None:
    """Say which textures a program looks things up in; each kind has one of its own, also where none is used."""
    program.use(bodies=0, lamp_map=_LAMP_UNIT, sky_maps=_SKY_UNIT)
