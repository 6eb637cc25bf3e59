"""Engine renderer, matched to the ray renderer: sky, floor lines, and translucent shapes."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from cellwright.rendering import engine_renderer
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import CastRenderer, PictureRequest
from cellwright.rendering.scene import Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.shading import LINE, TILE, background, to_screen
from cellwright.rendering.worker import RenderWorker
from cellwright.util.pose import Pose
from tests.rendering.scenes_of_shapes import AT_HOME, ball_at, skip_without_opengl
from tests.support.waiting import TIMEOUT

SCENE = Scene(
    "glass",
    ("world", "pane"),
    (
        SceneShape(0, ShapeType.PLANE, (0, 0, 1), AT_HOME, (0.7, 0.7, 0.7, 1), ShapeLayer.BOTH),
        SceneShape(0, ShapeType.BOX, (0.2, 0.2, 0.2), Pose((0, 2, 0.2)), (0.1, 0.2, 0.9, 1), ShapeLayer.BOTH),
        SceneShape(1, ShapeType.BOX, (0.5, 0.01, 0.5), AT_HOME, (0.9, 0.1, 0.1, 0.3), ShapeLayer.LOOKS),
    ),
    (),
)
GONE = ball_at(0, 0, 1, shown=False)
PANE = ball_at(0, 0, 0.5)


@pytest.fixture(scope="module")
def worker() -> Iterator[RenderWorker]:
    with RenderWorker(SCENE) as worker:
        skip_without_opengl(worker)
        yield worker


@pytest.mark.parametrize("towards", [(1, 0, 0.4), (0, -1, 0.5), (-1, 0.2, 1), (0.1, 0, 1)])
def test_sky_has_the_gradient_of_ray_pictures(worker: RenderWorker, towards: tuple[float, float, float]) -> None:
    camera = Camera((0, 0, 1), (towards[0], towards[1], 1 + towards[2]), fov=math.radians(20))
    drawn = worker.colour(GONE, PictureRequest(camera, 64, 48)).result(TIMEOUT).astype(int)
    cast = CastRenderer(SCENE).colour(GONE, PictureRequest(camera, 64, 48))
    assert np.abs(drawn - cast).max() <= 3


def test_floor_lines_are_where_ray_pictures_have_them(worker: RenderWorker) -> None:
    camera = Camera((0.3, -3, 1.5), (0.301, -3, 0), (0, 1, 0), fov=math.radians(70))
    drawn = worker.colour(GONE, PictureRequest(camera, 160, 120, shadows=False)).result(TIMEOUT).mean(axis=2)
    cast = CastRenderer(SCENE).colour(GONE, PictureRequest(camera, 160, 120)).mean(axis=2)
    for axis in (0, 1):
        lines = [set(np.flatnonzero(dark).tolist()) for dark in (_darker(drawn, axis), _darker(cast, axis))]
        assert lines[0] == lines[1]
        assert lines[0]


def _darker(picture: np.ndarray, axis: int) -> np.ndarray:
    """Rows or columns darker than those two steps away on either side."""
    profile = np.median(picture, axis=axis)
    dark = np.zeros(len(profile), bool)
    dark[2:-2] = profile[2:-2] < np.minimum(profile[:-4], profile[4:]) - 2
    return dark


def test_translucent_shapes_colour_what_is_behind_and_have_no_depth(worker: RenderWorker) -> None:
    camera = Camera((0, -2, 0.5), (0, 2, 0.2), fov=math.radians(40))
    depths = [worker.depth(frame, PictureRequest(camera, 64, 48)).result(TIMEOUT) for frame in (PANE, GONE)]
    assert np.array_equal(depths[0], depths[1])
    with_pane, without = (
        worker.colour(frame, PictureRequest(camera, 64, 48)).result(TIMEOUT).astype(int) for frame in (PANE, GONE)
    )
    assert with_pane[24, 32, 0] > without[24, 32, 0] + 10
    assert with_pane[24, 32, 2] > with_pane[24, 32, 1] + 10  # the box shines through


def test_floor_has_depth_far_beyond_haze(worker: RenderWorker) -> None:
    camera = Camera((0, 0, 2), (10, 0, 1.7), fov=math.radians(1))
    drawn = worker.depth(GONE, PictureRequest(camera, 32, 24)).result(TIMEOUT)
    cast = CastRenderer(SCENE).depth(GONE, PictureRequest(camera, 32, 24))
    assert 40 < cast.min() < cast.max() < 100
    np.testing.assert_allclose(drawn, cast, rtol=0.002)


def test_more_samples_smooth_edges_and_shadows(worker: RenderWorker) -> None:
    camera = Camera((0, -2, 2), (0, 2, 0), fov=math.radians(30))
    rough, smooth = (
        worker.colour(GONE, PictureRequest(camera, 80, 60, samples=count)).result(TIMEOUT) for count in (1, 4)
    )
    assert len(np.unique(smooth.reshape(-1, 3), axis=0)) > len(np.unique(rough.reshape(-1, 3), axis=0))
    assert np.abs(rough.astype(int) - smooth).mean() < 4


def test_sky_on_a_cube_is_the_background_of_each_direction() -> None:
    sky = engine_renderer._sky()
    side = sky.shape[1]
    assert sky.shape == (6 * side, side, 3)
    row, column = 5, 20
    x, up = (column + 0.5) / side * 2 - 1, 1 - (row + 0.5) / side * 2
    height = up / math.sqrt(1 + x * x + up * up)
    expected = to_screen(background(np.array([[0.0, 0.0, height]])))[0]
    for face in (0, 1, 4, 5):
        assert sky[face * side + row, column].tolist() == expected.tolist()
    above, below = sky[2 * side : 3 * side], sky[3 * side : 4 * side]
    assert not np.array_equal(above, below)


def test_tile_has_lines_of_their_width_through_its_middle() -> None:
    tile = engine_renderer._tile()
    side = len(tile)
    is_line = (tile[0] != 255).any(axis=1)
    assert is_line.sum() / side == pytest.approx(LINE / TILE, abs=2 / side)
    assert np.flatnonzero(is_line).mean() == pytest.approx(side / 2, abs=1)
