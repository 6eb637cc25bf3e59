"""Pictures of robots: they show all of the robot, which fills them."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.models.model import ModelShape
from cellwright.mechanism.shapes import visible_corners
from cellwright.robot.model import build_robot
from cellwright.robot.pictures import camera_on, robot_heading, save_robot_picture
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.model.robots import one_link
from tests.rendering.scenes import project

NUMBERS = st.floats(-3.0, 3.0)


@settings(max_examples=30, deadline=None)
@given(
    centre=st.tuples(NUMBERS, NUMBERS, NUMBERS),
    size=st.tuples(*[st.floats(0.01, 3.0)] * 3),
    heading=st.floats(-math.pi, math.pi),
    tilt=st.floats(-1.2, 1.2),
    shape=st.sampled_from([(100, 300), (300, 300), (640, 200)]),
)
def test_camera_shows_whole_robot_and_fills_picture(
    centre: tuple[float, float, float],
    size: tuple[float, float, float],
    heading: float,
    tilt: float,
    shape: tuple[int, int],
) -> None:
    world = build_robot(one_link(ModelShape("box", size, Pose(centre))))
    data = mujoco.MjData(world.model)
    camera = camera_on(world.model, data, heading, tilt, *shape)
    column, row, depth = project(camera, visible_corners(world.model, data), *shape).T
    assert np.all(depth > 0)
    assert 0.02 <= column.min() / shape[0] <= column.max() / shape[0] <= 0.98
    assert 0.02 <= row.min() / shape[1] <= row.max() / shape[1] <= 0.98
    assert max(np.ptp(column) / shape[0], np.ptp(row) / shape[1]) == pytest.approx(0.94)
    line = np.subtract(camera.eye, camera.target)
    assert line[2] / np.linalg.norm(line) == pytest.approx(math.sin(tilt), abs=1e-9)


@pytest.mark.parametrize("yaw", [0.0, math.pi / 2, 2.0])
def test_camera_faces_robot_at_any_heading(yaw: float) -> None:
    ball = ModelShape("sphere", (0.45, 0.0, 0.0))
    world = build_robot(one_link(ball, base_pose=Pose.from_rpy((1.0, 2.0, 3.0), (0.0, 0.0, yaw))))
    for turn in (0.0, math.pi / 2):
        data = mujoco.MjData(world.model)
        camera = camera_on(world.model, data, robot_heading(world, data) + turn, 0.0, 900, 1000)
        assert camera.target == pytest.approx((1.0, 2.0, 3.0), abs=1e-6)
        x, y, z = np.subtract(camera.eye, camera.target)
        assert (math.cos(yaw + turn), math.sin(yaw + turn)) == pytest.approx((x, y) / np.hypot(x, y))
        assert z == pytest.approx(0.0, abs=1e-6)


def test_robot_without_visible_shapes_gives_picture(tmp_path: Path) -> None:
    world = build_robot(one_link())
    save_robot_picture(tmp_path / "nothing.png", world, mujoco.MjData(world.model), (20, 20))
    assert (tmp_path / "nothing.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("shape", [(0, 100), (100, 0), (100, 100_000)])
def test_invalid_picture_size_is_refused(tmp_path: Path, shape: tuple[int, int]) -> None:
    world = build_robot(one_link())
    with pytest.raises(UsageError, match=r"width and height|picture"):
        save_robot_picture(tmp_path / "x.png", world, mujoco.MjData(world.model), shape)
