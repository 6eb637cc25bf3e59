"""Pictures of a cell as it stands, with no graphics library, no display and no GPU.

One ray through the middle of every pixel, light by `lamps` and `shading`, and then more rays through those pixels in
which surfaces or colours meet, so that edges are smooth.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor, as_completed
from queue import SimpleQueue
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.band import bands, draw_band
from cellwright.rendering.camera import Camera
from cellwright.rendering.lamps import disc_lamp, sky
from cellwright.rendering.raycast import PICTURE_GROUPS, RayCaster
from cellwright.rendering.shading import Light, Shader, to_screen
from cellwright.rendering.surfaces import Surfaces
from cellwright.util.errors import UsageError
from cellwright.util.pose import Vector3

Progress: TypeAlias = Callable[[float], None]
"""Called now and then with the share of the work that is done, 0..1."""

LARGEST_SIDE = 4096
"""The widest and highest picture, in pixels."""

LAMP: Vector3 = (-3.2, -4.6, 7.0)
"""Where the lamp of a picture is [m] from the point that the camera looks at, unless told otherwise."""

_LAMP_RADIUS = 0.14  # [m]
_SKY_DISTANCE = 9.0  # [m]


def render(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    camera: Camera,
    width: int = 1280,
    height: int = 720,
    *,
    samples: int = 2,
    groups: Collection[int] = PICTURE_GROUPS,
    lamp: Vector3 = LAMP,
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
        lamp: where the light comes from [m], from the point that the camera looks at, along the axes of the world.
        threads: how many threads share the work; by default one per core, four at most.
        progress: told how far it is, by the thread that called.

    Raises:
        UsageError: if `width`, `height`, `samples` or `threads` is out of range.
    """
    check_size(width, height)
    if not 1 <= samples <= 8:
        raise UsageError(f"the number of samples of a picture is between 1 and 8, not {samples}")
    if threads is not None and threads < 1:
        raise UsageError(f"a picture takes at least one thread, not {threads}")
    tell = progress or (lambda _: None)
    tell(0.0)

    # Every thread has a caster of its own; all are made here, so that the state is not read after this.
    casters = [RayCaster(model, data, groups=groups) for _ in range(threads or min(4, os.cpu_count() or 1))]
    surfaces = Surfaces(model, casters[0].still, casters[0].colours)
    light = Light(
        disc_lamp(_shifted(camera.target, lamp), camera.target, _LAMP_RADIUS),
        sky(camera.target, _SKY_DISTANCE),
    )
    eye = np.array(camera.eye, np.float64)
    idle: SimpleQueue[Shader] = SimpleQueue()
    for caster in casters:
        idle.put(Shader(caster, surfaces, light, eye, camera.fov / height))
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
                tell(done / len(jobs))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return picture


def check_size(width: int, height: int) -> None:
    """Refuse a picture that is empty, or too large.

    Raises:
        UsageError: it is.
    """
    for name, value in (("width", width), ("height", height)):
        if not 1 <= value <= LARGEST_SIDE:
            raise UsageError(f"the {name} of a picture is between 1 and {LARGEST_SIDE}, not {value}")


def _shifted(point: Vector3, offset: Vector3) -> Vector3:
    return (point[0] + offset[0], point[1] + offset[1], point[2] + offset[2])
