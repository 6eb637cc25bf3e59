"""Ray-cast pictures: layers of surfaces, smooth edges, bands drawn in parallel, and PNG files.

Bands keep the arrays small, and let several threads draw at once. Pixels share light with their neighbours. So a band
is drawn with a margin of rows above and below it, which are then dropped.

One ray goes through the middle of every pixel, with light by `lamps` and `shading`. Pixels in which surfaces or colours
meet get more rays, so that edges are smooth.
"""

import os
import struct
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.backend import RAYS
from cellwright.rendering.camera import Camera
from cellwright.rendering.raycast import Hits, RayCaster
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.engine import EngineScene
from cellwright.rendering.shading import Shader, Surfaces, disc_lamp, openness, sky, to_screen
from cellwright.util.errors import UsageError
from cellwright.util.files import write_atomic
from cellwright.util.pose import Vector3

_SAME_NORMAL = 0.9  # smallest cosine between the normals of a pixel and the neighbour whose light it borrows
_NEIGHBOURS = ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))
_COSINE = 0.95  # between the normals of neighbouring pixels
_COLOUR = 0.02  # between their colours, linear
BAND_HEIGHT = 90  # rows; two bands in a small picture of 320 x 180, twelve in one of 1920 x 1080
_MARGIN = 5  # rows; light is shared over three, borrowed over one, and edges need one
_PIXELS_AT_ONCE = 16384  # with more than one ray
SIGNATURE = b"\x89PNG\r\n\x1a\n"
TRUE_COLOUR, FILTER_UP = 2, 2
MAX_SIDE = 4096
"""Largest width and height of a picture, in pixels."""
LAMP: Vector3 = (-3.2, -4.6, 7.0)
"""Default position of the lamp [m], from the point that the camera looks at."""
_LAMP_RADIUS = 0.14  # [m]
_SKY_DISTANCE = 9.0  # [m]


@dataclass(frozen=True, slots=True)
class SurfaceLayer:
    """One surface per pixel (n,) of some rows of a picture, row by row, with its share of lamp and sky, 0..1.

    The colours `albedo` (n, 3) are linear; `width` is the picture's, in pixels.
    """

    hits: Hits
    albedo: NDArray[np.float32]
    key: NDArray[np.float32]
    sky: NDArray[np.float32]
    width: int

    @property
    def height(self) -> int:
        """Number of rows."""
        return len(self.key) // self.width

    def borrow(self, pixels: NDArray[np.int64], hits: Hits) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the shares of lamp and sky for surfaces `hits` anywhere within the `pixels` (n,).

        They are those of the pixel, or of a neighbour that shows the same surface. If none does (for surfaces finer
        than a pixel), they are those of the pixel.
        """
        key, sky = self.key[pixels], self.sky[pixels]
        rows, columns = np.divmod(pixels, self.width)
        open_ = np.arange(len(pixels))
        for down, right in _NEIGHBOURS:
            row = np.clip(rows[open_] + down, 0, self.height - 1)
            column = np.clip(columns[open_] + right, 0, self.width - 1)
            other = row * self.width + column
            same = self.hits.geom[other] == hits.geom[open_]
            same &= np.einsum("ij,ij->i", self.hits.normal[other], hits.normal[open_]) > _SAME_NORMAL
            key[open_[same]] = self.key[other[same]]
            sky[open_[same]] = self.sky[other[same]]
            open_ = open_[~same]
        return key, sky


def light_layer(shader: Shader, hits: Hits, directions: NDArray[np.float64], rows: range, width: int) -> SurfaceLayer:
    """Return the layer of the surfaces hit by rays in `directions` (len(rows) * width, 3), for rows of a picture."""
    points = shader.eye + directions * np.where(np.isfinite(hits.distance), hits.distance, 0.0)[:, None]
    key = openness(shader.caster, shader.key, hits, points, rows, width)
    sky = openness(shader.caster, shader.sky, hits, points, rows, width)
    return SurfaceLayer(hits, shader.albedo(hits, directions), key, sky, width)


def hits_behind(shader: Shader, hits: Hits, directions: NDArray[np.float64]) -> tuple[NDArray[np.int64], Hits]:
    """Return the rays (k,) that hit a translucent surface, and the opaque hits (k) behind it."""
    met = np.flatnonzero(hits.geom >= 0)
    at = met[shader.surfaces.opacity[hits.geom[met]] < 1]
    return at, shader.caster.cast(shader.eye, directions[at], through_translucent=True)


def light_seen(
    shader: Shader,
    layers: Sequence[SurfaceLayer],
    pixels: NDArray[np.int64],
    hits: Hits,
    directions: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Return the light (n, 3), linear, along rays within the `pixels` (n,) of a picture that hit `hits`.

    `layers` holds the picture's nearest surfaces, and those behind translucent ones, if any.
    """
    light = _light_of(shader, layers[0], pixels, hits, directions)
    if len(layers) > 1:
        at, hits_through = hits_behind(shader, hits, directions)
        through = _light_of(shader, layers[1], pixels[at], hits_through, directions[at])
        opacity = shader.surfaces.opacity[hits.geom[at]][:, None]
        light[at] = opacity * light[at] + (1 - opacity) * through
    return light


def _light_of(
    shader: Shader, layer: SurfaceLayer, pixels: NDArray[np.int64], hits: Hits, directions: NDArray[np.float64]
) -> NDArray[np.float32]:
    key, sky = layer.borrow(pixels, hits)
    return shader.colour(hits, directions, shader.albedo(hits, directions), key, sky)


def spread(hits: Hits, at: NDArray[np.int64], count: int) -> Hits:
    """Expand hits (k) to `count` rays: they go to the indices `at` (k,), and the other rays hit nothing."""
    geom = np.full(count, -1, np.int32)
    distance = np.full(count, np.inf)
    normal = np.zeros((count, 3))
    geom[at], distance[at], normal[at] = hits.geom, hits.distance, hits.normal
    return Hits(geom, distance, normal)


def edge_pixels(layer: SurfaceLayer) -> NDArray[np.int64]:
    """Return the pixels (k,) that differ from one of four neighbours in geom, colour or normal."""
    shape = (layer.height, layer.width)
    geom = layer.hits.geom.reshape(shape)
    normal = layer.hits.normal.astype(np.float32).reshape(*shape, 3)
    albedo = layer.albedo.reshape(*shape, 3)
    edge = np.zeros(shape, np.bool_)
    for here, there in (
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
    ):
        turned = np.einsum("ijk,ijk->ij", normal[here], normal[there]) < _COSINE
        differs = (geom[here] != geom[there]) | (turned & (geom[here] >= 0))
        differs |= np.abs(albedo[here] - albedo[there]).max(axis=2) > _COLOUR
        edge[here] |= differs
        edge[there] |= differs
    return np.flatnonzero(edge)


def pixel_points(pixels: NDArray[np.int64], width: int, *, samples: int) -> NDArray[np.float64]:
    """Return column and row of samples * samples points per pixel of `pixels` (n,): (n * samples * samples, 2).

    They lie in the middles of equal squares. Each row of squares is shifted a little against the next, so that nearly
    level and nearly upright edges come out smooth as well. One sample is the middle of the pixel.
    """
    step = np.arange(samples)
    down, right = (a.reshape(-1) for a in np.meshgrid(step, step, indexing="ij"))
    shift = (step - (samples - 1) / 2) / samples
    across = (right + 0.5 + shift[down]) / samples
    along = (down + 0.5 + shift[right]) / samples
    rows, columns = np.divmod(pixels, width)
    points = np.empty((len(pixels), samples * samples, 2))
    points[:, :, 0] = columns[:, None] + across
    points[:, :, 1] = rows[:, None] + along
    return points.reshape(-1, 2)


def bands(height: int) -> list[range]:
    """Split the rows of a picture into bands, from above."""
    return [range(first, min(first + BAND_HEIGHT, height)) for first in range(0, height, BAND_HEIGHT)]


def draw_band(
    shader: Shader, camera: Camera, width: int, height: int, rows: range, samples: int
) -> NDArray[np.float32]:
    """Return the light (len(rows), width, 3), linear, of some rows of a `width` x `height` picture.

    `samples` is the number of rays along each side of a pixel in which surfaces meet.
    """
    # Pixels share light with neighbours, so bands overlap; a band keeps only its own rows.
    wide = range(max(0, rows.start - _MARGIN), min(height, rows.stop + _MARGIN))
    start = wide.start * width  # pixel indices below count from here
    everywhere = np.arange(len(wide) * width)
    directions = camera.directions(pixel_points(start + everywhere, width, samples=1), width, height)
    hits = shader.caster.cast(shader.eye, directions)
    layers = [light_layer(shader, hits, directions, wide, width)]
    behind, hits_through = hits_behind(shader, hits, directions)
    if len(behind):
        layers.append(light_layer(shader, spread(hits_through, behind, len(directions)), directions, wide, width))

    kept = slice((rows.start - wide.start) * width, (rows.stop - wide.start) * width)
    light = light_seen(shader, layers, everywhere[kept], hits[kept], directions[kept])
    edges = edge_pixels(layers[0]) if samples > 1 else everywhere[:0]
    edges = edges[(edges >= kept.start) & (edges < kept.stop)]
    for first in range(0, len(edges), _PIXELS_AT_ONCE):
        pixels = edges[first : first + _PIXELS_AT_ONCE]
        directions = camera.directions(pixel_points(start + pixels, width, samples=samples), width, height)
        hits = shader.caster.cast(shader.eye, directions)
        seen = light_seen(shader, layers, np.repeat(pixels, samples * samples), hits, directions)
        # The mean is taken of linear light: a mean of sRGB would darken edges.
        light[pixels - kept.start] = seen.reshape(len(pixels), samples * samples, 3).mean(axis=1)
    return light.reshape(len(rows), width, 3)


def encode_png(picture: NDArray[np.uint8]) -> bytes:
    """Return the PNG file of a picture (height, width, 3) of 8 bits per channel, sRGB.

    Each row is stored as its difference to the row above (filter "up"), which suits smooth shading and costs one
    subtraction.

    Raises:
        UsageError: the array has another type or shape, or is empty.
    """
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 or picture.size == 0:
        raise UsageError(
            f"picture must be a (height, width, 3) array of uint8 (got {picture.shape} of {picture.dtype})"
        )
    height, width, _ = picture.shape
    rows = np.empty((height, 1 + 3 * width), np.uint8)
    rows[:, 0] = FILTER_UP
    rows[:, 1:] = picture.reshape(height, 3 * width)
    rows[1:, 1:] -= picture.reshape(height, 3 * width)[:-1]
    header = struct.pack(">IIBBBBB", width, height, 8, TRUE_COLOUR, 0, 0, 0)
    return (
        SIGNATURE
        + _png_chunk(b"IHDR", header)
        + _png_chunk(b"sRGB", b"\x00")
        + _png_chunk(b"IDAT", zlib.compress(rows.tobytes(), 6))
        + _png_chunk(b"IEND", b"")
    )


def save_png(path: str | Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture to a PNG file, whole or not at all.

    Raises:
        UsageError: the file cannot be written.
    """
    try:
        write_atomic(Path(path), encode_png(picture))
    except OSError as error:
        raise UsageError(f"cannot write the picture {path}: {error.strerror or error}") from error


def _png_chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


Progress: TypeAlias = Callable[[float], None]
"""Called from time to time with the finished share of the work, 0..1."""


def render(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    camera: Camera,
    size: tuple[int, int] = (1280, 720),
    *,
    samples: int = 2,
    lamp: Vector3 = LAMP,
    progress: Progress | None = None,
) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3), sRGB, of a cell in its present state.

    It only reads the state. The same state gives the same picture, on any number of cores.

    Args:
        model: the cell.
        data: its state; positions follow from `qpos`, whatever was last computed.
        camera: the camera.
        size: width and height [pixels], 1 to 4096.
        samples: rays along each side of a pixel in which surfaces meet, 1 to 8; 1 leaves edges jagged.
        lamp: position of the light [m], from the point that the camera looks at, along the world's axes.
        progress: called with the finished share, by the calling thread.

    Raises:
        UsageError: `size` or `samples` is out of range.
    """
    width, height = size
    check_size(width, height)
    if not 1 <= samples <= 8:
        raise UsageError(f"picture samples must be between 1 and 8 (got {samples})")
    report = progress or (lambda _: None)
    report(0.0)

    # Each thread has its own caster; all are made here, so that the state is not read after this.
    casters = [RayCaster(model, data) for _ in range(min(4, os.cpu_count() or 1))]
    surfaces = Surfaces(model, casters[0].still)
    key = disc_lamp(np.add(camera.target, lamp), camera.target, _LAMP_RADIUS)
    around = sky(camera.target, _SKY_DISTANCE)
    eye = np.array(camera.eye, np.float64)
    idle: SimpleQueue[Shader] = SimpleQueue()
    for caster in casters:
        idle.put(Shader(caster, surfaces, key, around, eye, camera.fov / height))
    picture = np.empty((height, width, 3), np.uint8)

    def draw(rows: range) -> None:
        shader = idle.get()
        try:
            picture[rows.start : rows.stop] = to_screen(draw_band(shader, camera, width, height, rows, samples))
        finally:
            idle.put(shader)

    with ThreadPoolExecutor(len(casters)) as pool:
        jobs = [pool.submit(draw, rows) for rows in bands(height)]
        try:
            for done, job in enumerate(as_completed(jobs), 1):
                job.result()
                report(done / len(jobs))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return picture


def check_size(width: int, height: int) -> None:
    """Raise UsageError for a picture that is empty or too large."""
    for name, value in (("width", width), ("height", height)):
        if not 1 <= value <= MAX_SIDE:
            raise UsageError(f"picture {name} must be between 1 and {MAX_SIDE} (got {value})")


@dataclass(frozen=True)
class PictureRequest:
    """Options of a picture for a renderer.

    Attributes:
        camera: the camera.
        width, height: [pixels].
        samples: points along each side of a pixel at edges; 1 leaves them jagged.
        shadows: True to draw shadows; the ray renderer always does.
        about: point [m] from which the lamp is placed, so that several or moving cameras have the same light; None for
            the camera's target.
        lamp: position of the light [m], from that point, along the world's axes.
    """

    camera: Camera
    width: int
    height: int
    samples: int = 2
    shadows: bool = True
    about: Vector3 | None = None
    lamp: Vector3 = LAMP


class CastRenderer:
    """Renderer that casts rays: slow, and available everywhere.

    Args:
        scene: the scene to draw.
    """

    description = RAYS

    def __init__(self, scene: Scene) -> None:
        self._scene = EngineScene(scene)

    def colour(self, frame: SceneFrame, request: PictureRequest) -> NDArray[np.uint8]:
        """Return a picture (height, width, 3), sRGB."""
        self._scene.show(frame)
        camera, about = request.camera, request.about or request.camera.target
        x, y, z = np.subtract(request.lamp, np.subtract(camera.target, about)).tolist()
        model, data, size = self._scene.model, self._scene.data, (request.width, request.height)
        return render(model, data, camera, size, samples=request.samples, lamp=(x, y, z))

    def depth(self, frame: SceneFrame, request: PictureRequest) -> NDArray[np.float32]:
        """Return the depths (height, width) [m] along the camera's line of sight.

        They are infinite where there is nothing. Translucent surfaces are ignored.
        """
        self._scene.show(frame)
        camera, width, height = request.camera, request.width, request.height
        directions = camera.directions(pixel_points(np.arange(width * height), width, samples=1), width, height)
        caster = RayCaster(self._scene.model, self._scene.data)
        hits = caster.cast(np.array(camera.eye, np.float64), directions, through_translucent=True)
        return (hits.distance * (directions @ camera.world_R_optical[:, 2])).reshape(height, width).astype(np.float32)
