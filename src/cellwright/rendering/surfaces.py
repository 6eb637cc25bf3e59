"""What the surfaces of a cell look like by themselves, before any light falls on them."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene.colours import linear

TILE = 1.0  # [m], spacing of the lines on a floor without texture
LINE = 0.012  # [m], width of these lines
LINE_SHADE = 0.8  # factor on the colour

PLASTIC_SPECULAR = 0.3
PLASTIC_SHININESS = 0.4


@dataclass(frozen=True, slots=True)
class _Decal:
    """A picture laid over a plane again and again, starting at a corner.

    Attributes:
        texels: the picture (rows, columns, 3), linear.
        half: half the sides (2,) of the plane [m].
        repeat: how often the picture fits on the plane, along x and y (2,).
    """

    texels: NDArray[np.float32]
    half: NDArray[np.float64]
    repeat: NDArray[np.float64]


class Surfaces:
    """Colours and gloss by geom id, as arrays that are indexed with many hits at once.

    Args:
        model: the cell.
        data: its state, for the places of its planes.
        colours: colour and opacity (ngeom, 4), sRGB.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, colours: NDArray[np.float64]) -> None:
        material = model.geom_matid
        has_material = material >= 0
        self.opacity = colours[:, 3].astype(np.float32)
        """(ngeom,) 0..1."""
        self.specular = np.full(model.ngeom, PLASTIC_SPECULAR, np.float32)
        """(ngeom,) how strong highlights are, 0..1."""
        self.shininess = np.full(model.ngeom, PLASTIC_SHININESS, np.float32)
        """(ngeom,) how small highlights are, 0..1."""
        self.specular[has_material] = model.mat_specular[material[has_material]]
        self.shininess[has_material] = model.mat_shininess[material[has_material]]
        self._plane = np.array(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
        self._place = np.array(data.geom_xpos)
        self._turn = np.array(data.geom_xmat).reshape(-1, 3, 3)
        self._base = linear(colours[:, :3])
        self._decals = {
            int(g): d for g in np.flatnonzero(has_material & self._plane) if (d := _decal(model, int(g))) is not None
        }

    def albedo(
        self, geom: NDArray[np.int32], points: NDArray[np.float64], footprint: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """The share of light that comes back (n, 3), linear, at surface `points` (n, 3) [m] of geoms (n,).

        `footprint` (n,) is how much of the surface [m] one pixel covers; patterns finer than that are blurred away.
        """
        colour = self._base[geom]
        for plane in np.flatnonzero(self._plane):
            at = np.flatnonzero(geom == plane)
            if not len(at):
                continue
            local = np.einsum("ij,jk->ik", points[at] - self._place[plane], self._turn[plane][:, :2])
            decal = self._decals.get(int(plane))
            colour[at] *= _lines(local, footprint[at])[:, None] if decal is None else _texels(decal, local)
        return colour


def _lines(local: NDArray[np.float64], footprint: NDArray[np.float64]) -> NDArray[np.float32]:
    """The factor (n,) that the joints between floor tiles put on the floor's colour at `local` (n, 2) [m]."""
    # The share of a pixel that a line covers: the overlap of two intervals, along either axis.
    offset = np.abs(local - np.round(local / TILE) * TILE)
    pixel = np.maximum(footprint, 1e-6)[:, None]
    covered = np.clip((LINE + pixel) / 2 - offset, 0, np.minimum(LINE, pixel)) / pixel
    share = 1 - (1 - covered[:, 0]) * (1 - covered[:, 1])
    return (1 - (1 - LINE_SHADE) * share).astype(np.float32)


def _decal(model: mujoco.MjModel, geom: int) -> _Decal | None:
    """The two-dimensional colour texture of a plane's material, if it has one.

    It lies as the engine's own drawing lays it: `texrepeat` counts repetitions on the whole plane, and with
    `texuniform` on every two metres; an endless plane counts as two metres wide.
    """
    material = model.geom_matid[geom]
    texture = model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB]
    if texture < 0 or model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D:
        return None
    height, width, channels = (int(t[texture]) for t in (model.tex_height, model.tex_width, model.tex_nchannel))
    start = model.tex_adr[texture]
    texels = np.array(model.tex_data[start : start + height * width * channels]).reshape(height, width, channels)
    rgb = texels[:, :, [0, 1, 2] if channels >= 3 else [0, 0, 0]]
    size = model.geom_size[geom, :2]
    half = np.where(size > 0, size, 1.0)
    repeat = model.mat_texrepeat[material] * (half if model.mat_texuniform[material] else 1.0)
    return _Decal(linear(rgb / 255), half, repeat)


def _texels(decal: _Decal, local: NDArray[np.float64]) -> NDArray[np.float32]:
    """The texture's colour (n, 3), linear, at `local` (n, 2) [m] of its plane."""
    height, width, _ = decal.texels.shape
    share = np.mod((local / decal.half + 1) / 2 * decal.repeat, 1.0)
    column = np.minimum((share[:, 0] * width).astype(int), width - 1)
    row = np.minimum(((1 - share[:, 1]) * height).astype(int), height - 1)
    colours: NDArray[np.float32] = decal.texels[row, column]
    return colours
