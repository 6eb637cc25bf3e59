"""What the pixels of a picture show: the nearest surface, and behind it, where that lets light through, the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.lamps import openness
from cellwright.rendering.raycast import Hits
from cellwright.rendering.shading import Shader

_SAME_SURFACE = 0.9  # smallest cosine between the normals of a pixel and the neighbour whose light it borrows
_NEIGHBOURS = ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))


@dataclass(frozen=True, slots=True)
class Layer:
    """One surface per pixel of some rows of a picture, and how much light reaches it.

    Attributes:
        hits: the surfaces (n,), row by row.
        albedo: their colours (n, 3), linear.
        key: how much of the lamp each sees, 0..1.
        sky: how much of the sky each sees, 0..1.
        width: of the picture, in pixels.
    """

    hits: Hits
    albedo: NDArray[np.float32]
    key: NDArray[np.float32]
    sky: NDArray[np.float32]
    width: int

    @property
    def height(self) -> int:
        """The number of rows."""
        return len(self.key) // self.width

    def borrow(self, pixels: NDArray[np.int64], hits: Hits) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """How much of lamp and sky the surfaces `hits` see, which lie anywhere within the `pixels` (n,).

        Read off the pixel itself or that one of its neighbours that shows the same surface; where none does (things
        finer than a pixel), off the pixel itself.
        """
        key, sky = self.key[pixels], self.sky[pixels]
        rows, columns = np.divmod(pixels, self.width)
        open_ = np.arange(len(pixels))
        for down, right in _NEIGHBOURS:
            row = np.clip(rows[open_] + down, 0, self.height - 1)
            column = np.clip(columns[open_] + right, 0, self.width - 1)
            other = row * self.width + column
            same = self.hits.geom[other] == hits.geom[open_]
            same &= np.einsum("ij,ij->i", self.hits.normal[other], hits.normal[open_]) > _SAME_SURFACE
            key[open_[same]] = self.key[other[same]]
            sky[open_[same]] = self.sky[other[same]]
            open_ = open_[~same]
        return key, sky


def light_layer(shader: Shader, hits: Hits, directions: NDArray[np.float64], rows: range, width: int) -> Layer:
    """The layer of surfaces that the rays in `directions` (len(rows) * width, 3) met, for those rows of a picture."""
    points = shader.eye + directions * np.where(np.isfinite(hits.distance), hits.distance, 0.0)[:, None]
    key = openness(shader.caster, shader.light.key, hits, points, rows, width)
    sky = openness(shader.caster, shader.light.sky, hits, points, rows, width)
    return Layer(hits, shader.albedo(hits, directions), key, sky, width)


def hits_behind(shader: Shader, hits: Hits, directions: NDArray[np.float64]) -> tuple[NDArray[np.int64], Hits]:
    """Which rays (k,) met something translucent, and what opaque (k) they meet behind it."""
    met = np.flatnonzero(hits.geom >= 0)
    at = met[shader.surfaces.opacity[hits.geom[met]] < 1]
    return at, shader.caster.cast(shader.eye, directions[at], through_translucent=True)


def light_seen(
    shader: Shader,
    layers: Sequence[Layer],
    pixels: NDArray[np.int64],
    hits: Hits,
    directions: NDArray[np.float64],
) -> NDArray[np.float32]:
    """The light (n, 3), linear, along rays that lie within the `pixels` (n,) of a picture and met `hits`.

    `layers` holds the picture's nearest surfaces, and those behind translucent ones if there are any.
    """
    light = _light_of(shader, layers[0], pixels, hits, directions)
    if len(layers) > 1:
        at, hits_through = hits_behind(shader, hits, directions)
        through = _light_of(shader, layers[1], pixels[at], hits_through, directions[at])
        opacity = shader.surfaces.opacity[hits.geom[at]][:, None]
        light[at] = opacity * light[at] + (1 - opacity) * through
    return light


def _light_of(
    shader: Shader, layer: Layer, pixels: NDArray[np.int64], hits: Hits, directions: NDArray[np.float64]
) -> NDArray[np.float32]:
    key, sky = layer.borrow(pixels, hits)
    return shader.colour(hits, directions, shader.albedo(hits, directions), key, sky)


def spread(hits: Hits, at: NDArray[np.int64], count: int) -> Hits:
    """The hits (k) at the places `at` (k,) among `count` rays of which the others met nothing."""
    geom = np.full(count, -1, np.int32)
    distance = np.full(count, np.inf)
    normal = np.zeros((count, 3))
    geom[at], distance[at], normal[at] = hits.geom, hits.distance, hits.normal
    return Hits(geom, distance, normal)
