"""Hands and grippers: their joints, and how far they are closed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.config import GripperConfig
from cellwright.config.robot.robots import load_robot
from cellwright.robot.grippers import LEFT, RIGHT, GripperRange, gripper_ranges, hand_joints
from tests.robot.robots import bare, two_arms

CONFIG = two_arms()
NUMBERS = {joint.name: number for number, joint in enumerate(CONFIG.robot.driven)}


def test_hand_joints_are_those_below_wrist() -> None:
    assert hand_joints(CONFIG, RIGHT) == frozenset({"finger_right", "thumb_right"})
    assert hand_joints(CONFIG, LEFT) == frozenset({"finger_left", "thumb_left"})


def test_hand_joints_without_arms_are_those_of_gripper() -> None:
    config = replace(CONFIG, arms=(), grippers=(GripperConfig(("finger_left",)),))
    assert hand_joints(config, RIGHT) == frozenset({"finger_left"})
    assert hand_joints(config, LEFT) == frozenset()


def test_hand_joints_of_plain_robot_are_none() -> None:
    assert hand_joints(bare(CONFIG), RIGHT) is None


def test_hand_joints_of_qinglong_include_more_than_gripper() -> None:
    config = load_robot("qinglong", lambda _line: None)
    right, left = hand_joints(config, RIGHT), hand_joints(config, LEFT)
    assert right is not None
    assert left is not None
    assert len(right) == len(left) == 22
    assert all(name.startswith("rh_") for name in right)
    assert all(name.startswith("lh_") for name in left)
    assert set(config.grippers[0].joints) < right


@given(st.floats(0.0, 1.0))
def test_gripper_status_is_recovered_from_positions(status: float) -> None:
    gripper = GripperRange(GripperConfig(("finger_left", "head")), CONFIG.robot, NUMBERS)
    positions = np.zeros(len(NUMBERS))
    positions[gripper.joints] = gripper.positions(status)
    assert gripper.status(positions) == pytest.approx(status, abs=1e-12)


@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(-100.0, 100.0))
def test_gripper_positions_and_status_stay_within_range(status: float, position: float) -> None:
    gripper = GripperRange(GripperConfig(("finger_left",)), CONFIG.robot, NUMBERS)
    assert 0.0 <= gripper.positions(status)[0] <= 0.04
    assert 0.0 <= gripper.status(np.full(len(NUMBERS), position)) <= 1.0


def test_gripper_ignores_unlimited_and_mimic_joints() -> None:
    gripper = GripperRange(GripperConfig(("wheel", "thumb_left", "antenna")), CONFIG.robot, NUMBERS)
    assert gripper.positions(1.0).tolist() == []
    assert gripper.status(np.ones(len(NUMBERS))) == 0.0
    assert len(gripper_ranges(CONFIG.grippers, CONFIG.robot, NUMBERS)) == 2
