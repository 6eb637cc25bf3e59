"""Postures of the UR10 on its rail."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import pose_on_tray, side_grip_pose
from cellwright.clients.agents.kitter.ur10_on_rail import (
    FOLDED_HEIGHT,
    RAIL_END,
    closest,
    faces_station,
    folded,
    near_posture,
    on_rail,
    side_posture,
    station_pan,
    station_posture,
)
from cellwright.motion import Joints, forward, link_poses, tool_down
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import STATIONS

PRESENT = Joints(0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0)
BIN = tool_down(-0.3, 0.23, 0.95)
TRAY = tool_down(0.3, 3.15, 0.95)
BELT = tool_down(1.21, 0.5, 1.0)


def off_by(joints: Joints, goal: Pose) -> float:
    return math.dist(forward(joints).position, goal.position)


@pytest.mark.parametrize(("goal", "rail"), [(BIN, 0.4), (TRAY, RAIL_END), (BELT, 0.2)])
def test_station_posture_faces_station(goal: Pose, rail: float) -> None:
    joints = station_posture(goal, rail, PRESENT)
    assert joints is not None
    assert off_by(joints, goal) < 1e-6
    assert faces_station(joints, station_pan(goal.position[0], goal.position[1], rail))


def test_pose_out_of_reach_has_no_posture() -> None:
    assert station_posture(tool_down(-0.3, 0.23, 0.95), -2.0, PRESENT) is None
    assert near_posture(tool_down(-0.3, 3.23, 0.95), 0.0, PRESENT) is None


def test_rail_position_is_clamped_to_its_ends() -> None:
    joints = station_posture(STATIONS[1].world_T_tray @ Pose((0.0, 0.0, 0.2)), 2.3, PRESENT)
    assert joints is not None
    assert joints.rail == on_rail(2.3) == RAIL_END
    assert on_rail(-7.0) == -RAIL_END
    assert on_rail(1.5) == 1.5


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_near_posture_of_close_pose_moves_joints_little(dx: float, dy: float, dz: float) -> None:
    here = station_posture(BIN, 0.4, PRESENT)
    assert here is not None
    x, y, z = BIN.position
    there = near_posture(Pose((x + dx, y + dy, z + dz), BIN.quaternion), 0.4, here)
    assert there is not None
    assert max(abs(a - b) for a, b in zip(here, there, strict=True)) < 0.25


def test_closest_posture_ignores_wrist_3() -> None:
    far, near = PRESENT._replace(elbow=0.0), PRESENT._replace(wrist_3=3.0)
    assert closest([far, near], PRESENT) is near


def test_folded_arm_keeps_direction_and_height() -> None:
    here = station_posture(BIN, 0.4, PRESENT)
    assert here is not None
    joints = Joints(*folded(here, here))
    assert (joints.rail, joints.shoulder_pan, joints.wrist_3) == (here.rail, here.shoulder_pan, here.wrist_3)
    tool = forward(joints)
    assert tool.position[2] == pytest.approx(FOLDED_HEIGHT)
    assert math.dist(tool.position[:2], (0.3, 0.4)) < 0.45


@given(st.sampled_from([1, 2]), st.floats(-0.1, 0.1), st.floats(-0.2, 0.2), st.floats(-3.0, 3.0))
def test_side_posture_has_wrist_above_hand(number: int, x: float, y: float, direction: float) -> None:
    pulley = Catalogue().figures("pulley_part")
    part = pose_on_tray(STATIONS[number], pulley, Pose((x, y, 0.0)), drop=0.0)
    goal = side_grip_pose(pulley, part, direction)
    joints = side_posture(goal, STATIONS[number].rail, PRESENT)
    if joints is None:
        return
    assert off_by(joints, goal) < 1e-6
    links = link_poses(joints)
    hand = links["vacuum_gripper_link"].position[2]
    assert min(pose.position[2] for pose in links.values()) > hand - 1e-6, "nothing is lower than the hand"
    assert links["wrist_1_link"].position[2] > hand + 0.1


def test_side_posture_reaches_middle_of_either_tray_from_its_station() -> None:
    pulley = Catalogue().figures("pulley_part")
    for station in STATIONS.values():
        part = pose_on_tray(station, pulley, Pose(), drop=0.0)
        goals = [side_grip_pose(pulley, part, 2 * math.pi * step / 16) for step in range(16)]
        assert any(side_posture(goal, station.rail, PRESENT) for goal in goals)
        assert not any(side_posture(goal, -station.rail, PRESENT) for goal in goals)
