"""From what a ray met to a colour: lamp, sky, highlights, haze and mirror images in a glossy floor.

Amounts of light are linear until the very end; `to_screen` turns them into sRGB.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.viewer.lamps import LampGroup
from cellwright.viewer.raycast import Hits, RayCaster
from cellwright.viewer.surfaces import Surfaces

_KEY = np.array((1.0, 0.955, 0.88), np.float32) * 1.12
_SKY = np.array((0.86, 0.93, 1.0), np.float32) * 0.52
_GROUND = np.array((0.95, 0.92, 0.88), np.float32) * 0.27
_BURIED = 0.22  # share of the sky's light that reaches the deepest corner, from other walls

_HORIZON = np.array((0.60, 0.66, 0.72), np.float32)
_ZENITH = np.array((0.20, 0.30, 0.44), np.float32)
_HAZE_START, _HAZE_END = 9.0, 26.0  # [m]

_MIRROR_DEPTH = 0.9  # [m]; mirror images fade with the height of what they show
_KNEE = 0.6  # amount of light above which the screen gets less than proportionally brighter
_F0 = 0.35  # share of a plane's reflectance that is left when seen from straight above


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

        `key` and `sky` (n,) say how much of lamp and sky the surface sees, 0..1.
        """
        result = background(directions)
        at = np.flatnonzero(hits.geom >= 0)
        if not len(at):
            return result
        ray, normal, geom = directions[at], hits.normal[at], hits.geom[at]
        points = self.eye + ray * hits.distance[at][:, None]
        lit = self._lit(points, normal, geom, albedo[at], key[at], sky[at], -ray)
        mirrors = np.flatnonzero(self.surfaces.reflectance[geom] > 0)
        for plane in np.unique(geom[mirrors]):
            on_plane = np.flatnonzero(geom == plane)
            lit[on_plane] += self._mirrored(int(plane), points[on_plane], -ray[on_plane])
        haze = _smooth((hits.distance[at] - _HAZE_START) / (_HAZE_END - _HAZE_START))[:, None]
        result[at] = lit * (1 - haze) + result[at] * haze
        return result

    def _lit(
        self,
        points: NDArray[np.float64],
        normal: NDArray[np.float64],
        geom: NDArray[np.int32],
        albedo: NDArray[np.float32],
        key: NDArray[np.float32],
        sky: NDArray[np.float32],
        to_eye: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """Light from surfaces: Lambert's law, a hemisphere of sky and ground, and Blinn's highlight."""
        to_lamp = self.light.key.centre - points
        to_lamp /= np.sqrt(np.einsum("ij,ij->i", to_lamp, to_lamp))[:, None]
        direct = np.maximum(0, np.einsum("ij,ij->i", to_lamp, normal)).astype(np.float32) * key
        up = (0.5 + 0.5 * normal[:, 2]).astype(np.float32)[:, None]
        around = (_SKY * up + _GROUND * (1 - up)) * (_BURIED + (1 - _BURIED) * sky)[:, None]
        result: NDArray[np.float32] = albedo * (direct[:, None] * _KEY + around)
        halfway = to_lamp + to_eye
        halfway /= np.sqrt(np.einsum("ij,ij->i", halfway, halfway))[:, None]
        cosine = np.clip(np.einsum("ij,ij->i", halfway, normal), 0, 1).astype(np.float32)
        sharpness = 8 + 120 * self.surfaces.shininess[geom]
        highlight = self.surfaces.specular[geom] * cosine**sharpness * key * (direct > 0)
        result += 0.35 * highlight[:, None] * _KEY
        return result

    def _mirrored(self, plane: int, points: NDArray[np.float64], to_eye: NDArray[np.float64]) -> NDArray[np.float32]:
        """The mirror image (n, 3) that `points` on a plane add.

        Seen in a mirror, the eye stands behind it; planes let rays from behind pass, so the image is one more bundle
        of rays from one origin.
        """
        normal = self.surfaces.turn[plane][:, 2]
        height = float((self.eye - self.surfaces.place[plane]) @ normal)
        result = np.zeros((len(points), 3), np.float32)
        if height <= 0:
            return result
        behind = self.eye - 2 * height * normal
        rays = points - behind
        way = np.sqrt(np.einsum("ij,ij->i", rays, rays))
        rays /= way[:, None]
        hits = self.caster.cast(behind, rays, through_translucent=True)
        at = np.flatnonzero((hits.geom >= 0) & (hits.distance > way + 1e-6))
        seen = behind + rays[at] * hits.distance[at][:, None]
        half = np.full(len(at), 0.6, np.float32)
        albedo = self.surfaces.albedo(hits.geom[at], seen, np.full(len(at), 1.0))
        image = self._lit(seen, hits.normal[at], hits.geom[at], albedo, half, half, -rays[at])
        grazing = (1 - np.clip(np.einsum("ij,j->i", to_eye[at], normal), 0, 1)) ** 3
        strength = self.surfaces.reflectance[plane] * (_F0 + (1 - _F0) * grazing)
        strength *= np.exp(-np.einsum("ij,j->i", seen - self.surfaces.place[plane], normal) / _MIRROR_DEPTH)
        result[at] = image * strength.astype(np.float32)[:, None]
        return result


def background(directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """The light (n, 3) where there is nothing, linear: bright from below up to the horizon, darker above."""
    height = _smooth(directions[:, 2] / 0.7)[:, None]
    return (_HORIZON * (1 - height) + _ZENITH * height).astype(np.float32)


def to_screen(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Values for the screen, sRGB 0..255 (IEC 61966-2-1), of amounts of light.

    Up to a knee they are taken as they are. Above it they approach 1 along a hyperbola that continues the straight
    line smoothly, so that bright surfaces keep some of their colour and shape.
    """
    x = np.maximum(light, 0)
    room = np.float32(1 - _KNEE)
    over = np.maximum(x - _KNEE, 0)
    shown = np.minimum(x, _KNEE) + room * over / (over + room)
    srgb = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 0.0031308) ** (1 / 2.4) - 0.055)
    return (srgb * 255 + 0.5).astype(np.uint8)


def _smooth(share: NDArray[np.float64]) -> NDArray[np.float32]:
    """A soft step from 0 at 0 to 1 at 1."""
    s = np.clip(share, 0, 1).astype(np.float32)
    return s * s * (3 - 2 * s)
