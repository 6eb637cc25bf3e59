"""Sliders as joint targets: within limits, at limited speed, and only on request."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.viewer.web.operator.moves import HOLD_TIME, JOINT_LEAD, JOINT_PATIENCE, JOINT_SPEED, JointMoves
from tests.viewer.web.operator.robots import number, seen, state

ELBOW = number("right_3")
FINGER = number("right_finger")


def at(**positions: float) -> tuple[float | None, ...]:
    found = list(state().positions)
    for name, value in positions.items():
        found[number(name)] = value
    return tuple(found)


def walked(requested: float, seconds: float, *, period: float = 0.02, follows: bool = True) -> tuple[list[float], str]:
    """Targets of the elbow, for a joint that follows at once or not at all; and the note."""
    moves = JointMoves(seen())
    position, found = -1.2, []
    moves.ask(ELBOW, requested, 0.0)
    for step in range(round(seconds / period)):
        target = moves.due(state(positions=at(right_3=position)), step * period)
        if target:
            assert set(target) == {ELBOW}, "only what was moved is sent"
            found.append(target[ELBOW])
            position = target[ELBOW] if follows else position
    return found, moves.note


@pytest.mark.slow
@given(st.floats(-3.0, 3.0) | st.floats(allow_nan=False), st.sampled_from([0.005, 0.02, 0.05, 0.3]))
def test_target_walks_within_limits_and_arrives(requested: float, period: float) -> None:
    found, _ = walked(requested, 4.0, period=period)
    assert all(-2.0 <= target <= 2.0 for target in found)
    assert found[-1] == min(max(requested, -2.0), 2.0)
    steps = [abs(after - before) for before, after in zip([-1.2, *found], found, strict=False)]
    assert max(steps) <= max(JOINT_SPEED["rad"] * min(period, 0.25), 0.0) + 1e-9, "however far the slider was thrown"


def test_blocked_joint_is_awaited_then_given_up() -> None:
    found, note = walked(1.0, JOINT_PATIENCE + 1.0, follows=False)
    assert max(found) <= -1.2 + JOINT_LEAD["rad"] + 1e-9
    assert note == "right_3 is blocked at -1.200"


def test_walk_begins_at_measured_position_not_at_old_target() -> None:
    moves = JointMoves(seen())
    moves.ask(ELBOW, -1.0, 0.0)
    for step in range(50):
        moves.due(state(positions=at(right_3=-1.0)), step * 0.02)
    moves.ask(ELBOW, 0.0, 100.0)
    target = moves.due(state(positions=at(right_3=1.5)), 100.02)[ELBOW]
    assert 1.4 < target < 1.5


def test_walk_without_measurement_begins_at_target() -> None:
    moves = JointMoves(seen())
    unknown = tuple(None if place == ELBOW else value for place, value in enumerate(state().positions))
    moves.ask(ELBOW, 2.0, 0.0)
    assert -1.2 <= moves.due(state(positions=unknown), 0.02)[ELBOW] < -1.1


def test_prismatic_joint_walks_in_metres() -> None:
    moves = JointMoves(seen())
    moves.ask(FINGER, 0.04, 0.0)
    assert 0.0 < moves.due(state(), 0.05)[FINGER] <= JOINT_SPEED["m"] * 0.05


def test_slider_follows_joint_unless_just_moved() -> None:
    moves = JointMoves(seen())
    assert not moves.is_touched(ELBOW, 0.0)
    moves.ask(ELBOW, -1.19, 0.0)
    assert moves.is_touched(ELBOW, 0.0)
    moves.due(state(), 0.1)
    assert moves.is_touched(ELBOW, 0.1 + HOLD_TIME / 2), "the joint is still on its way"
    assert not moves.is_touched(ELBOW, 0.2 + HOLD_TIME)
    assert moves.due(state(), 10.0) == {}, "and nothing is sent"


def test_give_way_ends_walk_of_its_joints_only() -> None:
    moves = JointMoves(seen())
    moves.ask(ELBOW, 1.0, 0.0)
    moves.ask(FINGER, 0.04, 0.0)
    moves.give_way((ELBOW,))
    assert set(moves.due(state(), 0.02)) == {FINGER}
    assert moves.forget()
    assert not moves.forget()
    assert moves.due(state(), 0.04) == {}
