"""From what a ray met to a colour: lamp, sky, highlights and haze.

Amounts of light are linear until the very end; `to_screen` turns them into sRGB.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.lamps import LampGroup
from cellwright.rendering.raycast import Hits, RayCaster
from cellwright.rendering.surfaces import Surfaces

KEY = np.array((1.0, 0.955, 0.88), np.float32) * 1.12
SKY = np.array((0.86, 0.93, 1.0), np.float32) * 0.52
GROUND = np.array((0.95, 0.92, 0.88), np.float32) * 0.27
BURIED = 0.22  # share of the sky's light that reaches the deepest corner, from other walls

HIGHLIGHT = 0.35  # share of the lamp's light in the middle of a highlight
SHARPNESS = (8.0, 128.0)  # exponents of Blinn's highlight at a shininess of 0 and of 1

HORIZON = np.array((0.60, 0.66, 0.72), np.float32)
ZENITH = np.array((0.20, 0.30, 0.44), np.float32)
HAZE_START, HAZE_END = 9.0, 26.0  # [m]

KNEE = 0.6  # amount of light above which the screen gets less than proportionally brighter


@dataclass(frozen=True, slots=True)
class Light:
    """The lamps of a picture."""

    key: LampGroup
    sky: LampGroup


@dataclass(frozen=True, slots=True)
class Shader:
    """Colours what rays from one eye met.

    Attributes:
        caster: the cell.
        surfaces: what its geoms look like.
        light: what shines on them.
        eye: where the rays start (3,) [m].
        pixel_angle: how far apart the rays of neighbouring pixels are [rad].
    """

    caster: RayCaster
    surfaces: Surfaces
    light: Light
    eye: NDArray[np.float64]
    pixel_angle: float

    def albedo(self, hits: Hits, directions: NDArray[np.float64]) -> NDArray[np.float32]:
        """The colour (n, 3) of the surfaces themselves, linear; zero where nothing was met."""
        result = np.zeros((len(hits.geom), 3), np.float32)
        at = np.flatnonzero(hits.geom >= 0)
        distance, ray = hits.distance[at], directions[at]
        slant = np.maximum(0.02, -np.einsum("ij,ij->i", ray, hits.normal[at]))
        points = self.eye + ray * distance[:, None]
        result[at] = self.surfaces.albedo(hits.geom[at], points, distance * self.pixel_angle / slant)
        return result

    def colour(
        self,
        hits: Hits,
        directions: NDArray[np.float64],
        albedo: NDArray[np.float32],
        key: NDArray[np.float32],
        sky: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """The light (n, 3) that comes back along rays in `directions` (n, 3), linear.

        Lambert's law for the lamp, a hemisphere of sky and ground, and Blinn's highlight; far things fade into the
        background. `key` and `sky` (n,) say how much of lamp and sky the surface sees, 0..1.
        """
        result = background(directions)
        at = np.flatnonzero(hits.geom >= 0)
        ray, normal, geom = directions[at], hits.normal[at], hits.geom[at]
        to_lamp = _unit(self.light.key.centre - self.eye - ray * hits.distance[at][:, None])
        direct = np.maximum(0, _cosine(to_lamp, normal)) * key[at]
        up = 0.5 + 0.5 * normal[:, 2:].astype(np.float32)
        around = (SKY * up + GROUND * (1 - up)) * (BURIED + (1 - BURIED) * sky[at])[:, None]
        lit = albedo[at] * (direct[:, None] * KEY + around)

        sharpness = SHARPNESS[0] + (SHARPNESS[1] - SHARPNESS[0]) * self.surfaces.shininess[geom]
        highlight = np.maximum(0, _cosine(_unit(to_lamp - ray), normal)) ** sharpness
        highlight *= HIGHLIGHT * self.surfaces.specular[geom] * key[at] * (direct > 0)
        lit += highlight[:, None] * KEY

        haze = _smooth((hits.distance[at] - HAZE_START) / (HAZE_END - HAZE_START))[:, None]
        result[at] = lit * (1 - haze) + result[at] * haze
        return result


def background(directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """The light (n, 3) where there is nothing, linear: bright from below up to the horizon, darker above."""
    height = _smooth(directions[:, 2] / 0.7)[:, None]
    return (HORIZON * (1 - height) + ZENITH * height).astype(np.float32)


def to_screen(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Values for the screen, sRGB 0..255 (IEC 61966-2-1), of amounts of light.

    Up to a knee they are taken as they are. Above it they approach 1 along a hyperbola that continues the straight
    line smoothly, so that bright surfaces keep some of their colour and shape.
    """
    x = np.maximum(light, 0)
    room = np.float32(1 - KNEE)
    over = np.maximum(x - KNEE, 0)
    shown = np.minimum(x, KNEE) + room * over / (over + room)
    srgb = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 0.0031308) ** (1 / 2.4) - 0.055)
    return (srgb * 255 + 0.5).astype(np.uint8)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """The vectors (n, 3) scaled to unit length; what is next to nothing stays so."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    scaled: NDArray[np.float64] = vectors / np.maximum(length, 1e-12)[:, None]
    return scaled


def _cosine(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float32]:
    """The cosine of the angle between each two of the unit vectors (n, 3)."""
    cosine: NDArray[np.float64] = np.einsum("ij,ij->i", a, b)
    return cosine.astype(np.float32)


def _smooth(share: NDArray[np.float64]) -> NDArray[np.float32]:
    """A soft step from 0 at 0 to 1 at 1."""
    s = np.clip(share, 0, 1).astype(np.float32)
    return s * s * (3 - 2 * s)
