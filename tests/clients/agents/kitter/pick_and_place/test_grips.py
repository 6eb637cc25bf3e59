"""Gripper poses to take a part and to put it down."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Held, grip_pose, pose_on_tray, release_pose
from cellwright.motion import face
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import STATIONS, TRAY_SURFACE

KINDS = Catalogue()
yaws = st.floats(-3.1, 3.1)


def flat(x: float, y: float, z: float, yaw: float) -> Pose:
    return Pose.from_rpy((x, y, z), (0.0, 0.0, yaw))


def test_grip_pose_of_rod_is_behind_its_head() -> None:
    gripper = grip_pose(KINDS.figures("piston_rod_part"), flat(-0.3, 0.2, 0.725, math.pi / 2), 0, 0.0)
    assert face(gripper) == pytest.approx((-0.34, 0.2, 0.7325))


def test_grip_pose_differs_with_each_attempt() -> None:
    places = {grip_pose(KINDS.figures("gear_part"), Pose(), attempt, 0.0).position for attempt in range(5)}
    assert len(places) == 5


@given(yaws, yaws, yaws, st.floats(-0.03, 0.03), st.floats(-0.03, 0.03))
def test_release_pose_puts_part_at_goal_for_any_grip(
    part_yaw: float, gripper_yaw: float, goal_yaw: float, dx: float, dy: float
) -> None:
    world_T_gripper = flat(-0.3 + dx, 0.2 + dy, 0.74, gripper_yaw)
    held = Held("gear_part", world_T_gripper.inverse() @ flat(-0.3, 0.2, 0.725, part_yaw))
    goal = flat(0.2, 3.3, 0.759, goal_yaw)
    there = release_pose(held, goal) @ held.gripper_T_part
    assert there.position == pytest.approx(goal.position)
    assert math.remainder(there.yaw - goal_yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_release_pose_of_tilted_part_keeps_cup_level() -> None:
    held = Held("gear_part", Pose.from_rpy((0.0, 0.0, -0.02), (0.05, 0.02, 0.3)))
    goal = release_pose(held, flat(0.2, 3.3, 0.759, 0.0))
    assert goal.rpy[:2] == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize(("number", "x", "y", "yaw"), [(1, 0.2, 3.35, math.pi + 0.3), (2, 0.4, -3.35, 0.3)])
def test_pose_on_tray_is_in_world_frame_of_each_agv(number: int, x: float, y: float, yaw: float) -> None:
    pose = pose_on_tray(STATIONS[number], KINDS.figures("gear_part"), flat(0.1, -0.2, 0.0, 0.3))
    assert pose.position[:2] == pytest.approx((x, y), abs=1e-3)
    assert pose.position[2] == pytest.approx(TRAY_SURFACE, abs=0.006)
    assert math.remainder(pose.yaw - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-3)
