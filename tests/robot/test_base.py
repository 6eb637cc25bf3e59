"""Motion of the base."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.robot.base import MAX_DISTANCE, MAX_STEP, TIMEOUT
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose
from tests.robot.robots import fixed, two_arms
from tests.robot.talk import Talk

QUARTER = math.pi / 2


def base_position(talk: Talk) -> tuple[float, ...]:
    talk.node.simulation.refresh()
    return tuple(talk.node.simulation.data.body("base").xpos.tolist())


def test_base_command_turns_and_moves_along_own_y_axis() -> None:
    talk = Talk()
    assert base_position(talk) == pytest.approx((0.0, 0.0, 0.5))
    talk.base(QUARTER, 0.2)
    talk.base(0.0, 0.3)  # along y, which is -x of the world by now
    talk.steps(2)
    assert base_position(talk) == pytest.approx((-0.3, 0.2, 0.5))
    assert talk.node.base.pose.yaw == pytest.approx(QUARTER)
    assert talk.at("shoulder_right") == pytest.approx(0.5, abs=1e-3), "joints moved with the base"


@pytest.mark.parametrize(
    ("numbers", "reason"),
    [
        ((), "must have 2 numbers .got 0."),
        ((0.1,), "must have 2 numbers .got 1."),
        ((0.1, 0.1, 0.1, 0.1), r"must have 2 numbers .got 4.: .*along y .m.; or 3: turn .rad., move along x and y .m."),
        ((0.1, 0.1, math.nan), "must be finite"),
        ((0.0, math.nan), "must be finite"),
        ((math.inf, 0.0), "must be finite"),
        ((0.0, MAX_STEP + 0.1), "data must be between -10 and 10"),
    ],
)
def test_invalid_base_command_is_refused_whole(numbers: tuple[float, ...], reason: str) -> None:
    talk = Talk()
    with pytest.raises(RejectedCommandError, match=reason):
        talk.base(*numbers)
    assert talk.node.base.pose == two_arms().base_pose


@given(st.lists(st.tuples(st.floats(-10, 10), st.floats(-10, 10)), max_size=12))
def test_base_pose_stays_valid_and_within_bounds(moves: list[tuple[float, float]]) -> None:
    for move in moves:
        with suppress(RejectedCommandError):  # beyond 1000 m
            SHARED.base(*move)
    pose = SHARED.node.base.pose
    assert math.hypot(*pose.quaternion) == pytest.approx(1.0)
    assert max(map(abs, pose.position)) <= MAX_DISTANCE


SHARED = Talk()


def test_fixed_robot_has_no_base_topic() -> None:
    talk = Talk(fixed(two_arms()))
    with pytest.raises(UnknownNameError):
        talk.base(0.0, 0.1)


def test_three_numbers_without_a_mode_are_distances_and_said_once() -> None:
    talk = Talk()
    for _ in range(2):
        talk.base(QUARTER, 0.2, 0.1)
    assert talk.node.base.pose.position == pytest.approx((0.2 - 0.1, 0.1 + 0.2, 0.5))
    assert talk.node.base.pose.yaw == pytest.approx(math.pi)
    (line,) = talk.lines
    assert line.startswith("/io_teleop/target_base_move: 3 numbers are taken as turn [rad] and motion along x and y")
    assert line.endswith("for speeds set base_command_mode: velocity in the robot configuration (logged once)")


def test_delta_mode_takes_three_numbers() -> None:
    talk = Talk(replace(two_arms(), others={"base_command_mode": "delta"}))
    talk.base(QUARTER, 0.2, 0.1)
    assert talk.node.base.pose.position == pytest.approx((0.2, 0.1, 0.5))
    with pytest.raises(RejectedCommandError, match=r"3 numbers .got 2.: turn .rad., move along x and y"):
        talk.base(0.0, 0.1)


def test_velocity_mode_moves_until_timeout_or_stop() -> None:
    talk = Talk(replace(two_arms(), others={"base_command_mode": "velocity"}))
    for _ in range(10):
        talk.base(0.0, 0.5, -0.25)
        talk.seconds(0.1)
    assert talk.node.base.pose.position[:2] == pytest.approx((0.5, -0.25), abs=0.01)
    talk.seconds(2.0)
    assert talk.node.base.pose.position[:2] == pytest.approx((0.45 + 0.5 * TIMEOUT, -0.225 - 0.25 * TIMEOUT), abs=0.01)
    talk.base(0.0, 0.5, 0.0)
    talk.steps(2)
    talk.stop()
    stopped = talk.node.base.pose
    talk.seconds(0.5)
    assert talk.node.base.pose == stopped


def test_reset_returns_base_to_initial_pose() -> None:
    talk = Talk()
    talk.base(1.0, 1.0)
    talk.node.simulation.reset()
    assert talk.node.base.pose == Pose((0.0, 0.0, 0.5))
    assert base_position(talk) == pytest.approx((0.0, 0.0, 0.5))
