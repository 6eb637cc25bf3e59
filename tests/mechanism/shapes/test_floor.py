"""The floor under a robot: visible, at the lowest point, and without contacts."""

import mujoco
import numpy as np
import pytest

from cellwright.config.models.model import ModelShape
from cellwright.mechanism.shapes import FLOOR, visible_corners
from cellwright.robot.model import build_robot
from cellwright.util.pose import Pose
from tests.cell.model.robots import one_link


def test_floor_is_at_lowest_visible_point() -> None:
    leg = ModelShape("cylinder", (0.1, 1.0, 0.0), Pose((0.0, 0.0, -0.3)))
    world = build_robot(one_link(leg, base_pose=Pose((0.0, 0.0, 2.0))), self_collision=True)
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    assert data.geom(FLOOR).xpos[2] == pytest.approx(2.0 - 0.3 - 0.5)
    assert data.ncon == 0


def test_floor_of_robot_without_shapes_is_at_height_0() -> None:
    world = build_robot(one_link())
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    assert data.geom(FLOOR).xpos[2] == 0.0
    assert visible_corners(world.model, data).shape == (0, 3)


def test_visible_corners_leave_out_hidden_shapes() -> None:
    lying = Pose.from_rpy((0.0, 0.0, 1.0), (0.0, np.pi / 2, 0.0))
    box = ModelShape("box", (0.2, 0.4, 0.6), lying)
    hidden = ModelShape("sphere", (5.0, 0.0, 0.0), is_seen=False)
    world = build_robot(one_link(box, hidden))
    corners = visible_corners(world.model, mujoco.MjData(world.model))
    assert corners.min(axis=0) == pytest.approx((-0.3, -0.2, 0.9))
    assert corners.max(axis=0) == pytest.approx((0.3, 0.2, 1.1))
