"""Shading of the ray renderer: soft lamps, surface colours, and light that comes back along a ray.

Lamp and sky are groups of point lamps. Testing every lamp for every pixel would cost too much. So neighbouring pixels
test different lamps of a group, in a repeating square. They then share the results with those neighbours that lie on
the same surface (interleaved sampling: Keller and Heidrich, 2001).

Light is linear until the very end; `to_screen` converts it to sRGB.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from cellwright.rendering.raycast import Hits, RayCaster
from cellwright.rendering.scene.scene import linear

_STEP = 11  # from a lamp to the next one tested; prime to the number of lamps
_GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
_SAME_SURFACE = 0.9  # smallest cosine between the normals of neighbours that share
SIDE = 5
"""Side of the square of pixels that share the lamps of a group; odd."""

TILE = 1.0  # [m], spacing of the lines on a floor
LINE = 0.012  # [m], width of these lines
LINE_SHADE = 0.8  # factor on the colour
KEY = np.array((1.0, 0.955, 0.88), np.float32) * 1.12
SKY = np.array((0.86, 0.93, 1.0), np.float32) * 0.52
GROUND = np.array((0.95, 0.92, 0.88), np.float32) * 0.27
BURIED = 0.22  # share of the sky's light that reaches the deepest corner, from other walls
HIGHLIGHT = 0.105  # share of the lamp's light in the middle of a highlight
SHARPNESS = 56.0  # exponent of Blinn's highlight
HORIZON = np.array((0.60, 0.66, 0.72), np.float32)
ZENITH = np.array((0.20, 0.30, 0.44), np.float32)
HAZE_START, HAZE_END = 9.0, 26.0  # [m]
KNEE = 0.6  # amount of light above which the screen's response is less than proportional


def disc_lamp(centre: ArrayLike, towards: ArrayLike, radius: float) -> NDArray[np.float64]:
    """Point lamps (SIDE * SIDE, 3) [m] of a disc of `radius` [m] at `centre` that faces the point `towards` [m]."""
    axis = np.subtract(towards, centre, dtype=np.float64)
    axis /= np.linalg.norm(axis)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    upward = np.cross(axis, across)
    index = np.arange(SIDE * SIDE)
    # Sunflower: with radii by the square root, and steps of the golden angle, each lamp has the same area of the disc.
    reach = radius * np.sqrt((index + 0.5) / len(index))
    angle = index * _GOLDEN_ANGLE
    offsets = reach[:, None] * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * upward)
    return np.asarray(centre) + _scattered(offsets)


def sky(centre: ArrayLike, distance: float) -> NDArray[np.float64]:
    """Point lamps (SIDE * SIDE, 3) [m] all over the upper half of a sphere of radius `distance` about `centre` [m]."""
    index = np.arange(SIDE * SIDE)
    # Slices of a sphere with equal heights have equal areas (Archimedes), so each lamp has the same part of the sky.
    height = (index + 0.5) / len(index)
    angle = index * _GOLDEN_ANGLE
    flat = np.sqrt(1 - height * height)
    directions = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height])
    return np.asarray(centre) + distance * _scattered(directions)


def _scattered(lamps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Reorder the lamps so that those of neighbouring pixels lie far apart."""
    return lamps[np.arange(len(lamps)) * _STEP % len(lamps)]


def openness(
    caster: RayCaster, lamps: NDArray[np.float64], hits: Hits, points: NDArray[np.float64], rows: range, width: int
) -> NDArray[np.float32]:
    """Return the visible share of a group of lamps for each pixel's surface, 1 if nothing is in the way.

    Args:
        caster: the cell.
        lamps: the group (SIDE * SIDE, 3) [m].
        hits: hits of the pixels, row by row (len(rows) * width).
        points: their positions (len(rows) * width, 3) [m].
        rows: these rows of the picture; a pixel's place in the picture selects its lamp.
        width: width of the picture in pixels.

    Returns:
        (len(rows) * width,) in 0..1; 0 where the surface faces away from the lamps, and for a miss.
    """
    shape = (len(rows), width)
    # A pixel asks for one lamp, by its place in a square of SIDE x SIDE; then pixels of one surface share the answers.
    chosen = np.add.outer(np.array(rows) % SIDE * SIDE, np.arange(width) % SIDE).reshape(-1)
    facing = np.zeros(len(chosen), np.float32)
    seen = np.zeros(len(chosen), np.float32)
    for number, lamp in enumerate(lamps):
        at = np.flatnonzero((chosen == number) & (hits.geom >= 0))
        towards = lamp - points[at]
        cosine = np.einsum("ij,ij->i", towards, hits.normal[at]) / np.sqrt(np.einsum("ij,ij->i", towards, towards))
        at, cosine = at[cosine > 0], cosine[cosine > 0]
        facing[at] = cosine
        seen[at] = cosine * caster.reaches(lamp, points[at])
    facing, seen = _shared(facing.reshape(shape), seen.reshape(shape), hits, SIDE // 2)
    facing, seen = _shared(facing, seen, hits, 1)  # smooths the remains of the squares
    return np.divide(seen, facing, out=np.zeros_like(seen), where=facing > 0).reshape(-1)


def _shared(
    facing: NDArray[np.float32], seen: NDArray[np.float32], hits: Hits, reach: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sum each pixel of both pictures (height, width) with neighbours up to `reach` away on the same surface."""
    height, width = facing.shape
    geom = hits.geom.reshape(height, width)
    normal = hits.normal.astype(np.float32).reshape(height, width, 3)
    facing_sum, seen_sum = facing.copy(), seen.copy()
    for down in range(reach + 1):
        for right in range(-reach, reach + 1):
            if (down, right) <= (0, 0):
                continue  # each pair of neighbours once
            here = (slice(0, height - down), slice(max(0, -right), width - max(0, right)))
            there = (slice(down, height), slice(max(0, right), width + min(0, right)))
            same = geom[here] == geom[there]
            same &= np.einsum("ijk,ijk->ij", normal[here], normal[there]) > _SAME_SURFACE
            for total, part in ((facing_sum, facing), (seen_sum, seen)):
                total[here] += same * part[there]
                total[there] += same * part[here]
    return facing_sum, seen_sum


class Surfaces:
    """Colours by geom id, as arrays to index with many hits at once; `data` has the poses of planes."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self.opacity = np.array(model.geom_rgba[:, 3])
        """(ngeom,) 0..1."""
        self._plane = np.array(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
        self._place = np.array(data.geom_xpos)
        self._turn = np.array(data.geom_xmat).reshape(-1, 3, 3)
        self._base = linear(model.geom_rgba[:, :3])

    def albedo(
        self, geom: NDArray[np.int32], points: NDArray[np.float64], footprint: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return the albedo (n, 3), linear, at surface `points` (n, 3) [m] of geoms (n,).

        `footprint` (n,) is the length of surface [m] in one pixel; finer patterns are blurred away.
        """
        colour = self._base[geom]
        for plane in np.flatnonzero(self._plane):
            at = np.flatnonzero(geom == plane)
            if not len(at):
                continue
            local = np.einsum("ij,jk->ik", points[at] - self._place[plane], self._turn[plane][:, :2])
            colour[at] *= _lines(local, footprint[at])[:, None]
        return colour


def _lines(local: NDArray[np.float64], footprint: NDArray[np.float64]) -> NDArray[np.float32]:
    """Factor (n,) of the lines between floor tiles on the floor's colour at `local` (n, 2) [m]."""
    # The share of a pixel that a line covers: the overlap of two intervals, along either axis.
    offset = np.abs(local - np.round(local / TILE) * TILE)
    pixel = np.maximum(footprint, 1e-6)[:, None]
    covered = np.clip((LINE + pixel) / 2 - offset, 0, np.minimum(LINE, pixel)) / pixel
    share = 1 - (1 - covered[:, 0]) * (1 - covered[:, 1])
    return (1 - (1 - LINE_SHADE) * share).astype(np.float32)


@dataclass(frozen=True, slots=True)
class Shader:
    """Shader for rays from one eye (3,) [m]; rays of neighbouring pixels are `pixel_angle` [rad] apart."""

    caster: RayCaster
    surfaces: Surfaces
    key: NDArray[np.float64]
    sky: NDArray[np.float64]
    eye: NDArray[np.float64]
    pixel_angle: float

    def albedo(self, hits: Hits, directions: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the albedo (n, 3) of the surfaces, linear; zero for a miss."""
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
        """Return the light (n, 3) that comes back along rays in `directions` (n, 3), linear.

        Lambert's law for the lamp, a hemisphere of sky and ground, and Blinn's highlight. Distant surfaces fade into
        the background. `key` and `sky` (n,) are the visible shares of lamp and sky, 0..1.
        """
        result = background(directions)
        at = np.flatnonzero(hits.geom >= 0)
        ray, normal = directions[at], hits.normal[at]
        to_lamp = _unit(self.key.mean(axis=0) - self.eye - ray * hits.distance[at][:, None])
        direct = np.maximum(0, _cosine(to_lamp, normal)) * key[at]
        up = 0.5 + 0.5 * normal[:, 2:].astype(np.float32)
        around = (SKY * up + GROUND * (1 - up)) * (BURIED + (1 - BURIED) * sky[at])[:, None]
        lit = albedo[at] * (direct[:, None] * KEY + around)

        highlight = np.maximum(0, _cosine(_unit(to_lamp - ray), normal)) ** SHARPNESS
        highlight *= HIGHLIGHT * key[at] * (direct > 0)
        lit += highlight[:, None] * KEY

        haze = _smooth((hits.distance[at] - HAZE_START) / (HAZE_END - HAZE_START))[:, None]
        result[at] = lit * (1 - haze) + result[at] * haze
        return result


def background(directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the light (n, 3) of the background, linear: bright from below up to the horizon, darker above."""
    height = _smooth(directions[:, 2] / 0.7)[:, None]
    return (HORIZON * (1 - height) + ZENITH * height).astype(np.float32)


def to_screen(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert amounts of light to sRGB 0..255 for the screen (IEC 61966-2-1).

    They stay as they are up to a knee. Above it they approach 1 along a hyperbola that continues the straight line
    smoothly, so that bright surfaces keep some of their colour and shape.
    """
    x = np.maximum(light, 0)
    room = np.float32(1 - KNEE)
    over = np.maximum(x - KNEE, 0)
    shown = np.minimum(x, KNEE) + room * over / (over + room)
    srgb = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * np.maximum(shown, 0.0031308) ** (1 / 2.4) - 0.055)
    return (srgb * 255 + 0.5).astype(np.uint8)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale vectors (n, 3) to unit length; tiny ones stay tiny."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    scaled: NDArray[np.float64] = vectors / np.maximum(length, 1e-12)[:, None]
    return scaled


def _cosine(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float32]:
    """Cosines of the angles between unit vectors (n, 3), pair by pair."""
    cosine: NDArray[np.float64] = np.einsum("ij,ij->i", a, b)
    return cosine.astype(np.float32)


def _smooth(share: NDArray[np.float64]) -> NDArray[np.float32]:
    """Smooth step from 0 at 0 to 1 at 1."""
    s = np.clip(share, 0, 1).astype(np.float32)
    return s * s * (3 - 2 * s)
