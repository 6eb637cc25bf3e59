import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from cellwright.config.arm import ARM_JOINTS
from cellwright.motion import LIMITS, Joints, solve, tool_down
from cellwright.util.errors import UnknownNameError, UsageError
from tests.motion.samples import INITIAL, anywhere


def test_joints_are_read_by_name_in_any_order() -> None:
    by_name = INITIAL.by_name()
    assert tuple(by_name) == ARM_JOINTS
    assert Joints.of({**dict(reversed(by_name.items())), "vacuum_gripper_joint": 0.0}) == INITIAL
    assert Joints.of(INITIAL) is INITIAL


def test_invalid_joints_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="elbow_joint"):
        Joints.of({name: 0.0 for name in ARM_JOINTS if name != "elbow_joint"})
    with pytest.raises(UsageError, match="finite"):
        Joints.of(INITIAL._replace(elbow=math.nan))
    with pytest.raises(UnknownNameError, match=r"unknown arm joint 'linear_arm_actuator_joint' \(known: 0, 1\)"):
        Joints.of({0: 0.0, 1: 0.0})  # type: ignore[dict-item]  # as a user may


@pytest.mark.parametrize("positions", [list(INITIAL), tuple(INITIAL), np.array(INITIAL), []])
def test_positions_without_names_are_refused_since_their_order_is_not_known(positions: Any) -> None:
    reason = "names no joints, and lists of the client have another order; give Joints"
    with pytest.raises(UsageError, match=reason):
        Joints.of(positions)
    with pytest.raises(UsageError, match=reason):
        solve(tool_down(-0.3, 0.23, 0.85), positions)


def test_ordered_returns_values_in_given_order() -> None:
    assert INITIAL.ordered(("wrist_1_joint", "linear_arm_actuator_joint")) == [3.77, 0.0]
    with pytest.raises(UnknownNameError, match="did you mean elbow_joint"):
        INITIAL.ordered(("elbow_jiont",))


def test_within_limits_checks_every_joint() -> None:
    assert INITIAL.within_limits()
    assert Joints(*LIMITS).within_limits()
    assert not INITIAL._replace(rail=2.11).within_limits()
    assert not INITIAL._replace(wrist_3=-6.3).within_limits()


@given(anywhere, anywhere)
def test_nearest_chooses_nearest_turn_of_each_angle(joints: Joints, near: Joints) -> None:
    nearest = joints.nearest(near)
    assert nearest.within_limits()
    assert nearest.rail == joints.rail
    for mine, was, other in zip(nearest[1:], joints[1:], near[1:], strict=True):
        assert abs(math.remainder(mine - was, 2 * math.pi)) < 3e-9
        for turns in (-2, -1, 1, 2):
            if abs(mine + turns * 2 * math.pi) <= 2 * math.pi:
                assert abs(mine - other) <= abs(mine + turns * 2 * math.pi - other) + 1e-9


@given(anywhere)
def test_turned_yields_all_turns_within_limits(joints: Joints) -> None:
    choices = set(joints.turned())
    assert len(choices) >= 2**6
    assert any(math.dist(joints, each) < 1e-9 for each in choices)
    assert all(each.within_limits() for each in choices)
