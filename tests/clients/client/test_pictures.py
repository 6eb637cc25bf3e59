"""Pictures of cameras for programs: as readings of other sensors, with their arrays."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import CameraPicture, Client
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.middleware.messages.arrays import points_array
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose
from tests.support.cells import WHOLE

DOWN = Pose.from_rpy((-0.3, 0.03, 1.4), (0.0, math.pi / 2, 0.0))
CAMERAS = (
    PictureCameraConfig("both", "rgbd_camera", DOWN, width=16, height=12),
    PictureCameraConfig("depths", "depth_camera", DOWN, width=16, height=12),
    PictureCameraConfig("colours", "rgb_camera", DOWN, width=16, height=12),
)
TRIAL: Trial = replace(WHOLE, sensors=(*WHOLE.sensors, *CAMERAS))


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> Iterator[Cell]:
    """Yield a cell with cameras; it is closed afterwards, with its render process."""
    monkeypatch.setenv("CELLWRIGHT_RENDERING", "rays")
    made = Cell(TRIAL)
    yield made
    made.simulation.close()


def shapes(picture: CameraPicture | None) -> tuple[tuple[int, ...] | None, ...]:
    """Return the shapes of colours, depths and points."""
    assert picture is not None
    return tuple(None if each is None else each.shape for each in (picture.colour, picture.depth, picture.points))


def test_picture_has_colours_depths_and_points_of_one_moment(cell: Cell) -> None:
    client = Client.in_process(cell)
    cloud = client.latest("/ariac/both/depth/points")
    picture = client.sensor("both").wait(1.0)
    assert isinstance(picture, CameraPicture)
    assert (picture.time_ns, picture.frame) == (100_000_000, "both_optical_frame")
    assert picture.colour is not None
    assert (picture.colour.shape, str(picture.colour.dtype)) == ((12, 16, 3), "uint8")
    assert picture.depth is not None
    assert (picture.depth.shape, str(picture.depth.dtype)) == ((12, 16), "float32")
    assert picture.points is not None
    assert picture.points.dtype == np.float32
    assert np.allclose(picture.points, points_array(cloud.message), atol=1e-6, equal_nan=True)


def test_each_kind_of_camera_has_its_channels(cell: Cell) -> None:
    client = Client.in_process(cell)
    depths, colours = client.camera("depths"), client.camera("colours")
    assert client.wait_until(lambda: None not in (depths.message, colours.message), 1.0)
    assert shapes(depths.message) == (None, (12, 16), (12, 16, 3))
    assert shapes(colours.message) == ((12, 16, 3), None, None)
    cloud = client.sensor("depths").wait(1.0)  # a PointCloud, as in 2018
    assert points_array(cloud).shape[1] == 3


def test_callback_gets_each_picture_until_cancelled(cell: Cell) -> None:
    client = Client.in_process(cell)
    got: list[int] = []
    cancel = client.on_sensor("colours", lambda picture: got.append(picture.time_ns))
    client.sleep(0.45)
    cancel()
    client.sleep(0.2)
    assert got == [100_000_000, 200_000_000, 300_000_000]


def test_unknown_camera_is_refused_with_known_ones(cell: Cell) -> None:
    client = Client.in_process(cell)
    with pytest.raises(UnknownNameError, match=r"camera 'bth'; did you mean both \(known: both, colours, depths\)"):
        client.camera("bth")
    with pytest.raises(UnknownNameError, match="sensor 'bth'; did you mean both"):
        client.sensor("bth")


def test_restored_run_has_same_pictures(cell: Cell) -> None:
    client = Client.in_process(cell)
    latest = client.camera("both")
    client.sleep(0.25)  # one picture has come, the next is being drawn
    taken = cell.snapshot()

    def seen() -> list[object]:
        client.sleep(0.3)
        picture = latest.message
        assert picture is not None
        assert picture.colour is not None
        assert picture.depth is not None
        return [latest.count, picture.time_ns, picture.colour.tobytes(), picture.depth.tobytes()]

    first = seen()
    cell.restore(taken)
    assert seen() == first
    cell.reset(seed=5)
    assert (latest.message, latest.count) == (None, 0)
