"""Pictures of cameras: the time of one, of many cells in one render process, and of a point cloud.

Cameras of the lesson, over a bin and with a view of the whole cell, take them by the backend of this machine; without a
graphics card that is software OpenGL. Times are wall times, from the request in the cell's process to the picture
there.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from benchmarks.benchmarks import Figure, OnProgress
from benchmarks.timing import best_in_turn, processor_time
from cellwright.cell.cell import Cell
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.clock import NANOSECONDS
from cellwright.rendering.backend import RAYS
from cellwright.rendering.cameras.interface import points_message
from cellwright.rendering.cameras.picture_camera import PictureCamera, read_pictures
from cellwright.util.pose import Pose

REPEATS = 30
CELLS = 8
SMALL, LARGE = 4.0, 20.0
"""Bounds [ms] of small colour pictures, and of those of 640 x 480."""

_OVER_BIN = Pose((-0.3, 0.23, 1.7), (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0))  # straight down
_WHOLE_CELL = Pose((-4.4, -3.1, 3.3), (0.9385, -0.0599, 0.2107, 0.2667))  # the view `overview`
_DEPTH_SIZE = (640, 480)
_SIZES = ((84, 84, SMALL), (128, 128, SMALL), (640, 480, LARGE))


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Time pictures of each size, alone and of several cells, and messages with points."""
    repeats, count = (1, 2) if quick else (REPEATS, CELLS)
    on_progress(f"{count} cells")
    cells = [_cell(seed) for seed in range(1, count + 1)]
    cameras = [{name: _camera(cell, name) for name in cell.sensors if name.startswith("bench")} for cell in cells]
    try:
        cameras[0]["bench_depth"].read()  # starts the process
        backend = cells[0].render_service.backend
        for width, height, bound in _SIZES:
            on_progress(f"{width} x {height}")
            each = [found[f"bench_{width}"] for found in cameras]
            alone = _best(repeats, each[0].read)
            together = _best(repeats, partial(read_pictures, each)) / count
            maximum = _bound(backend, bound)
            label = f"a colour picture of {width} x {height}"
            yield Figure(label, alone, "ms", maximum=maximum, note=backend)
            yield Figure(f"{label}, of {count} cells at once", together, "ms", maximum=maximum, note="each")
        whole = _best(repeats, cameras[0]["bench_whole"].read)
        yield Figure("a colour picture of 128 x 128, the whole cell", whole, "ms", maximum=_bound(backend, SMALL))
        on_progress("depths and points")
        camera = cameras[0]["bench_depth"]
        size = f"{camera.pinhole.width} x {camera.pinhole.height}"
        yield Figure(f"colours and depths of {size}", _best(repeats, camera.read), "ms")
        picture = camera.read()
        (spent,) = best_in_turn(repeats, partial(processor_time, partial(points_message, picture, camera)))
        yield Figure(f"a PointCloud2 of a picture of {size}", spent * 1e3, "ms", note="with colours")
    finally:
        for found in cameras:
            for camera in found.values():
                camera.close()


def _bound(backend: str, bound: float) -> float | None:
    """Return the bound of a picture [ms]; rays have none."""
    return None if backend == RAYS else bound


def _cell(seed: int) -> Cell:
    """Return the lesson's cell with cameras of each size, a tenth of a second after its start."""
    trial = load_trial([find_trial("lesson")]).trial
    settings = [(f"bench_{width}", "rgb_camera", _OVER_BIN, width, height) for width, height, _ in _SIZES]
    settings.append(("bench_whole", "rgb_camera", _WHOLE_CELL, 128, 128))
    settings.append(("bench_depth", "rgbd_camera", _OVER_BIN, *_DEPTH_SIZE))
    more = tuple(
        PictureCameraConfig(name, kind, pose, width=width, height=height)
        for name, kind, pose, width, height in settings
    )
    cell = Cell(replace(trial, sensors=(*trial.sensors, *more)), seed=seed)
    cell.simulation.step_until(NANOSECONDS // 10)
    return cell


def _camera(cell: Cell, name: str) -> PictureCamera:
    camera = cell.sensors[name]
    assert isinstance(camera, PictureCamera)
    return camera


def _best(repeats: int, work: Callable[[], object]) -> float:
    """Return the least wall time [ms] of some work."""
    return best_in_turn(repeats, partial(_wall_time, work))[0] * 1e3


def _wall_time(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin
