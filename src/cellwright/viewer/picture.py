"""Pictures of a cell as it stands, with no graphics library, no display and no GPU.

One ray through the middle of every pixel, light by `lamps` and `shading`, and then more rays through those pixels in
which surfaces or colours meet, so that edges are smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.errors import UsageError
from cellwright.pose import Vector3
from cellwright.viewer.camera import Camera
from cellwright.viewer.edges import edge_pixels, pixel_points
from cellwright.viewer.lamps import disc_lamp, sky
from cellwright.viewer.layers import hits_behind, light_layer, light_seen, spread
from cellwright.viewer.png import encode
from cellwright.viewer.raycast import PICTURE_GROUPS, RayCaster
from cellwright.viewer.shading import Light, Shader, to_screen
from cellwright.viewer.surfaces import Surfaces

Progress: TypeAlias = Callable[[float], None]
"""Called now and then with the share of the work that is done, 0..1."""

LARGEST_SIDE = 4096
"""The widest and highest picture, in pixels."""

_LAMP_OFFSET = (-3.2, -4.6, 7.0)  # [m] from the point the camera looks at
_LAMP_RADIUS = 0.22  # [m]
_SKY_DISTANCE = 9.0  # [m]
_PIXELS_AT_ONCE = 16384


def render(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    camera: Camera,
    width: int = 1280,
    height: int = 720,
    *,
    samples: int = 3,
    groups: Collection[int] = PICTURE_GROUPS,
    threads: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.uint8]:
    """A picture (height, width, 3), sRGB, of the cell in its present state.

    The state is only read. The same state gives the same picture, on however many threads.

    Args:
        model: the cell.
        data: its state; positions follow from `qpos`, whatever was computed last.
        camera: where it is seen from.
        width: in pixels, 1 to 4096.
        height: in pixels, 1 to 4096.
        samples: rays along each side of a pixel in which surfaces meet, 1 to 8; 1 leaves edges jagged.
        groups: the geom groups that are drawn.
        threads: how many threads share the work; by default one per core, four at most.
        progress: told how far it is.

    Raises:
        UsageError: if `width`, `height`, `samples` or `threads` is out of range.
    """
    limits = {"width": (width, LARGEST_SIDE), "height": (height, LARGEST_SIDE), "samples": (samples, 8)}
    for name, (value, largest) in limits.items():
        if not 1 <= value <= largest:
            raise UsageError(f"the {name} of a picture is between 1 and {largest}, not {value}")
    if threads is not None and threads < 1:
        raise UsageError(f"a picture takes at least one thread, not {threads}")
    tell = progress or (lambda _: None)
    tell(0.0)

    caster = RayCaster(model, data, groups=groups, threads=threads)
    shader = Shader(
        caster,
        Surfaces(model, caster.still, caster.colours),
        Light(
            disc_lamp(_shifted(camera.target, _LAMP_OFFSET), camera.target, _LAMP_RADIUS),
            sky(camera.target, _SKY_DISTANCE),
        ),
        np.array(camera.eye, np.float64),
        camera.fov / height,
    )
    everywhere = np.arange(width * height)
    directions = camera.directions(pixel_points(everywhere, width, samples=1), width, height)
    tell(0.05)
    hits = caster.cast(shader.eye, directions)
    layers = [light_layer(shader, hits, directions, width, height)]
    tell(0.5)
    behind, hits_through = hits_behind(shader, hits, directions)
    if len(behind):
        layers.append(light_layer(shader, spread(hits_through, behind, len(directions)), directions, width, height))
    light = light_seen(shader, layers, everywhere, hits, directions)
    tell(0.6)

    edges = edge_pixels(layers[0]) if samples > 1 else everywhere[:0]
    for first in range(0, len(edges), _PIXELS_AT_ONCE):
        pixels = edges[first : first + _PIXELS_AT_ONCE]
        directions = camera.directions(pixel_points(pixels, width, samples=samples), width, height)
        hits = caster.cast(shader.eye, directions)
        seen = light_seen(shader, layers, np.repeat(pixels, samples * samples), hits, directions)
        light[pixels] = seen.reshape(len(pixels), samples * samples, 3).mean(axis=1)
        tell(0.6 + 0.4 * first / len(edges))
    picture = to_screen(light).reshape(height, width, 3)
    tell(1.0)
    return picture


def save_picture(
    path: str | Path,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    camera: Camera,
    width: int = 1280,
    height: int = 720,
    *,
    samples: int = 3,
    groups: Collection[int] = PICTURE_GROUPS,
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Writes a picture as `render` makes it to the file `path`, as PNG.

    Raises:
        UsageError: if an argument is out of range (see `render`) or the file cannot be written.
    """
    picture = render(
        model, data, camera, width, height, samples=samples, groups=groups, threads=threads, progress=progress
    )
    try:
        Path(path).write_bytes(encode(picture))
    except OSError as error:
        raise UsageError(f"cannot write the picture {path}: {error.strerror or error}") from error


def _shifted(point: Vector3, offset: Vector3) -> Vector3:
    return (point[0] + offset[0], point[1] + offset[1], point[2] + offset[2])
