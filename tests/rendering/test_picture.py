import math
import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import render
from cellwright.util.errors import UsageError
from tests.rendering.scenes import FLOOR, clutter, project, scene

SIZE = WIDTH, HEIGHT = 120, 90
BALL = '<geom type="sphere" size=".5" pos="{}" rgba="1 0 0 1" group="1"/>'
CAMERA = Camera((0, -4, 0), (0, 0, 0), fov=math.radians(40))
ABOVE = Camera((0.01, 0, 8), (0, 0, 0), fov=math.radians(50))


def is_red(picture: NDArray[np.uint8]) -> NDArray[np.bool_]:
    red: NDArray[np.bool_] = picture[:, :, 0] > picture[:, :, 2] + 20.0
    return red


def radius_of_ball(distance: float, height: int) -> float:
    """Distance [pixels] of a ball's rim (0.5 m) from its middle in the picture: at the tangent from the eye."""
    return 0.5 / math.sqrt(distance**2 - 0.5**2) * height / (2 * math.tan(CAMERA.fov / 2))


def test_ball_covers_expected_disc() -> None:
    picture = render(*scene(BALL.format("0 0 0")), CAMERA, SIZE, samples=1)
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    from_middle = np.hypot(rows - HEIGHT / 2, columns - WIDTH / 2)
    assert np.array_equal(is_red(picture), from_middle < radius_of_ball(4, HEIGHT))


def test_picture_is_not_mirrored() -> None:
    picture = render(*scene(BALL.format(".8 0 .5")), CAMERA, SIZE, samples=1)
    rows, columns = np.nonzero(is_red(picture))
    expected = project(CAMERA, np.array([[0.8, 0, 0.5]]), WIDTH, HEIGHT)[0]
    assert columns.mean() == pytest.approx(expected[0], abs=1)
    assert rows.mean() == pytest.approx(expected[1], abs=1)
    assert columns.mean() > WIDTH / 2
    assert rows.mean() < HEIGHT / 2


def test_samples_smooth_edges_only() -> None:
    model, data = scene(BALL.format("0 0 0"))
    jagged, smooth = (render(model, data, CAMERA, SIZE, samples=n).astype(float) for n in (1, 4))
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    from_rim = np.hypot(rows - HEIGHT / 2, columns - WIDTH / 2) - radius_of_ball(4, HEIGHT)
    outside = from_rim > 2
    assert np.array_equal(jagged[outside], smooth[outside])
    inside = from_rim < -6
    assert np.abs(jagged[inside] - smooth[inside]).max() <= 2
    rim = np.abs(from_rim) < 0.5
    assert len(np.unique(smooth[rim][:, 2])) > len(np.unique(jagged[rim][:, 2]))
    between = (smooth[rim][:, 2] > smooth[inside][:, 2].max() + 20) & (
        smooth[rim][:, 2] < smooth[outside][:, 2].min() - 20
    )
    assert between.mean() > 0.4


def test_bodies_cast_shadows() -> None:
    # the lamp is at (-3.2, -4.6, 7) from the camera's target: a slab 1 m up casts its shadow beyond itself
    slab = '<geom type="box" size=".3 .3 .02" pos="0 0 1" rgba="1 1 1 1" group="1"/>'
    lamp, centre = np.array([-3.2, -4.6, 7.0]), np.array([0, 0, 1.0])
    shadow = lamp + (centre - lamp) * lamp[2] / (lamp[2] - centre[2])
    open_, shaded = (render(*scene(FLOOR + world), ABOVE, SIZE).astype(float) for world in ("", slab))
    column, row = (int(v) for v in project(ABOVE, shadow[None], WIDTH, HEIGHT)[0, :2])
    assert shaded[row, column].mean() < open_[row, column].mean() - 30
    column, row = (int(v) for v in project(ABOVE, shadow[None] * (-3, -3, 1), WIDTH, HEIGHT)[0, :2])
    assert shaded[row, column].mean() == pytest.approx(open_[row, column].mean(), abs=2)


def test_translucent_body_shows_body_behind() -> None:
    pane = '<geom type="box" size="1 .01 .7" pos="0 -1 0" rgba="0 0 1 {}" group="2"/>'
    colours = {
        opacity: render(*scene(BALL.format("0 0 0") + pane.format(opacity)), CAMERA, SIZE)[45, 60].astype(int)
        for opacity in (0, 0.3, 0.7, 1)
    }
    reds = [colours[o][0] for o in (0, 0.3, 0.7, 1)]
    blues = [colours[o][2] for o in (0, 0.3, 0.7, 1)]
    assert reds == sorted(reds, reverse=True)
    assert blues == sorted(blues)
    assert len({*reds}) == len({*blues}) == 4


def test_collision_shapes_are_not_drawn() -> None:
    empty = render(*scene(""), CAMERA, (40, 30))
    assert np.array_equal(render(*scene(BALL.format("0 0 0").replace('"1"', '"3"')), CAMERA, (40, 30)), empty)
    assert not np.array_equal(render(*scene(BALL.format("0 0 0")), CAMERA, (40, 30)), empty)


def test_picture_is_identical_on_any_number_of_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    model, data = clutter(3)
    camera = Camera((4, -5, 2), (0, 0, 0))
    first = render(model, data, camera, (160, 120))
    for cores in (1, 2, 3, None):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        assert np.array_equal(render(model, data, camera, (160, 120)), first)


FALLING = (
    '<body pos="0 0 .6"><freejoint/><geom type="box" size=".1 .1 .1" group="1"/></body>'
    '<body pos=".05 0 1"><freejoint/><geom type="cylinder" size=".1 .05" group="1"/></body>'
)


def state_after(steps: int, *, watched: bool) -> NDArray[np.float64]:
    model, data = scene(FLOOR + FALLING)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    states = []
    everything = mujoco.mjtState.mjSTATE_INTEGRATION
    for step in range(steps):
        mujoco.mj_step(model, data)
        if watched and step % 100 == 0:
            render(model, data, ABOVE, (16, 12), samples=2)
        state = np.empty(mujoco.mj_stateSize(model, everything))
        mujoco.mj_getState(model, data, state, everything)
        states.append(np.concatenate([state, data.xpos.ravel(), data.tree_asleep]))
    return np.array(states)


def test_render_leaves_state_unchanged() -> None:
    assert state_after(800, watched=True).tobytes() == state_after(800, watched=False).tobytes()


def test_progress_runs_from_zero_to_one() -> None:
    shares: list[float] = []
    render(*clutter(1), Camera((4, -5, 2), (0, 0, 0)), (20, 500), progress=shares.append)
    assert shares[0] == 0
    assert shares[-1] == 1
    assert shares == sorted(shares)
    assert len(shares) > 4


def test_error_while_drawing_reaches_caller() -> None:
    def give_up(share: float) -> None:
        if share > 0:
            raise UsageError("enough")

    with pytest.raises(UsageError, match="enough"):
        render(*clutter(1), Camera((4, -5, 2), (0, 0, 0)), (20, 500), progress=give_up)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (3, 2)])
def test_smallest_pictures_are_drawn(size: tuple[int, int]) -> None:
    assert render(*scene(BALL.format("0 0 0")), CAMERA, size).shape == (size[1], size[0], 3)


@pytest.mark.parametrize(
    ("width", "height", "samples"), [(0, 10, 1), (10, -1, 1), (5000, 10, 1), (10, 10, 0), (10, 10, 9)]
)
def test_impossible_picture_sizes_are_refused(width: int, height: int, samples: int) -> None:
    with pytest.raises(UsageError, match="picture"):
        render(*scene(FLOOR), CAMERA, (width, height), samples=samples)


def test_render_loads_no_graphics_library() -> None:
    script = (
        "import sys, mujoco; from cellwright.rendering import picture, camera;"
        "m = mujoco.MjModel.from_xml_string('<mujoco/>');"
        "picture.render(m, mujoco.MjData(m), camera.Camera((1, 0, 0), (0, 0, 0)), (8, 6));"
        "print([n for n in sys.modules if n.split('.')[0] in ('OpenGL', 'glfw', 'PIL', 'matplotlib')"
        " or n.startswith(('mujoco.egl', 'mujoco.osmesa', 'mujoco.gl_context'))])"
    )
    # if glfw is installed, for the window, the engine loads it unless the environment forbids that
    alone = {**os.environ, "MUJOCO_GL": "disable"}
    done = subprocess.run([sys.executable, "-c", script], env=alone, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
