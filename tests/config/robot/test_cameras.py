"""Cameras of a robot configuration: their links, their directions, and invalid ones."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cellwright.config.robot.cameras import look_rotation, picture_camera
from cellwright.config.robot.config import CameraConfig
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.robot.robots import two_arms

ROBOT = two_arms()
VECTORS = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


def camera(name: str = "first_person", **values: Any) -> CameraConfig:
    return CameraConfig(name, {"name": name, **values})


@pytest.mark.parametrize(
    ("name", "link"),
    [
        ("first_person", "head"),
        ("hand_eye", "tip_right"),
        ("hand_eye_right", "tip_right"),
        ("left_hand_eye", "tip_left"),
        ("anything", "head"),
    ],
)
def test_camera_link_follows_from_camera_name(name: str, link: str) -> None:
    tips = [replace(arm, tip=f"tip_{side}") for arm, side in zip(ROBOT.arms, ("right", "left"), strict=True)]
    assert picture_camera(replace(ROBOT, arms=tuple(tips)), camera(name)).frame == link


def test_camera_of_robot_without_head_and_arms_is_on_root() -> None:
    bare = replace(ROBOT, arms=(), head=None)
    assert {picture_camera(bare, camera(name)).frame for name in ("first_person", "hand_eye")} == {"base"}


def test_camera_without_entries_has_defaults() -> None:
    found = picture_camera(ROBOT, camera())
    assert (found.width, found.height, found.near, found.far, found.pose) == (640, 480, 0.1, 10.0, Pose())
    assert 2 * math.atan(math.tan(found.fov / 2) * 480 / 640) == pytest.approx(math.radians(100))


def test_camera_with_all_entries_has_their_values() -> None:
    found = picture_camera(
        ROBOT,
        camera(
            quat=[0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)],  # a quarter turn to the left
            pos_offset=[0.1, 0.0, 0.2],
            target_offset=[0.1, 0.0, -1.0],
            height=0.3,
            up_axis="y",
            near_val=0.005,
            far_val=4,
            img_width=320,
            img_height=200,
        ),
    )
    assert found.pose.position == pytest.approx((0.0, 0.1, 0.5))
    assert found.pose.rotate((1.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, -1.0))
    assert found.pose.rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 1.0, 0.0))
    assert (found.near, found.far, found.width, found.height) == (0.02, 4.0, 320, 200)


@pytest.mark.parametrize(("written", "up"), [("Z", 2), (0, 0), ([0, 2, 0], 1)])
def test_up_axis_in_each_notation_points_up_in_picture(written: object, up: int) -> None:
    target = [0.0, 1.0, 0.0] if up != 1 else [1.0, 0.0, 0.0]
    found = picture_camera(ROBOT, camera(up_axis=written, target_offset=target))
    assert found.pose.rotate((0.0, 0.0, 1.0))[up] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"name": "a b"}, "its name becomes a topic"),
        ({"img_width": 4}, "img_width must be a whole number from 8 to 1920 (got 4)"),
        ({"img_height": True}, "img_height must be a whole number"),
        ({"img_width": 1920, "img_height": 1080}, "pictures must have at most 1000000 pixels (got 1920 x 1080)"),
        ({"near_val": 3, "far_val": 2}, "near_val must be less than far_val (got 3 and 2 m)"),
        ({"near_val": 0}, "near_val must be above 0 m"),
        ({"far_val": "much"}, "far_val must be a number (got 'much')"),
        ({"pos_offset": [1, 2]}, "pos_offset must be a list of 3 numbers (got [1, 2])"),
        ({"quat": [0, 0, 0, None]}, "quat must be a list of 4 numbers"),
        ({"up_axis": "w"}, "up_axis must be a list of 3 numbers (got 'w')"),
        ({"up_axis": "x"}, "the up axis must not be parallel to the line of sight"),
        ({"up_axis": [0, 0, 0]}, "the up axis must not be parallel to the line of sight"),
        ({"target_offset": [0, 0, 0]}, "the target must differ from the position"),
    ],
)
def test_invalid_camera_entries_are_refused(values: dict[str, Any], reason: str) -> None:
    name = values.pop("name", "first_person")
    with pytest.raises(UsageError) as error:
        picture_camera(ROBOT, camera(name, **values))
    assert reason in str(error.value)


@given(forward=VECTORS, up=VECTORS)
def test_look_rotation_points_forward_with_up_closest_to_z(
    forward: tuple[float, float, float], up: tuple[float, float, float]
) -> None:
    length, height = math.hypot(*forward), math.hypot(*up)
    assume(min(length, height) > 0.1)
    cosine = sum(a * b for a, b in zip(forward, up, strict=True)) / length / height
    assume(abs(cosine) < 0.99)
    turn = Pose((0.0, 0.0, 0.0), look_rotation(forward, up))
    assert turn.rotate((1.0, 0.0, 0.0)) == pytest.approx([each / length for each in forward], abs=1e-6)
    above, across = turn.rotate((0.0, 0.0, 1.0)), turn.rotate((0.0, 1.0, 0.0))
    assert sum(a * b for a, b in zip(across, up, strict=True)) == pytest.approx(0.0, abs=1e-5)
    assert sum(a * b for a, b in zip(above, up, strict=True)) > 0
