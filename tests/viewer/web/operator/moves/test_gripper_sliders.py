"""Gripper sliders: each command holds all grippers, and untouched ones keep their targets."""

from cellwright.viewer.web.operator.moves import HOLD_TIME, GripperSliders
from tests.viewer.web.operator.robots import state


def test_other_gripper_keeps_target_not_position() -> None:
    grips = GripperSliders(2)
    holding = state(grippers=(0.0, 0.3), gripper_targets=(0.0, 0.9))
    grips.ask(0, 0.5, 0.0)
    assert grips.due(holding, 0.0) == (0.5, 0.9), "what it holds between its fingers is not let go of"
    assert grips.due(holding, 0.1) is None, "once is enough"


def test_both_grippers_are_sent_before_first_is_reported() -> None:
    grips = GripperSliders(2)
    grips.ask(0, 1.0, 0.0)
    assert grips.due(state(), 0.0) == (1.0, 0.0)
    grips.ask(1, 1.0, 0.01)
    assert grips.due(state(), 0.01) is None, "no more often than 50 times a second"
    assert grips.due(state(), 0.03) == (1.0, 1.0)


def test_gripper_requests_are_clamped_and_held() -> None:
    grips = GripperSliders(2)
    grips.ask(0, 7.0, 0.0)
    grips.ask(1, -1.0, 0.0)
    assert grips.due(state(), 0.0) == (1.0, 0.0)
    assert grips.is_touched(0, HOLD_TIME / 2)
    assert not grips.is_touched(0, HOLD_TIME)
    grips.ask(0, 0.2, 5.0)
    assert grips.forget()
    assert not grips.forget()
    assert grips.due(state(), 6.0) is None
