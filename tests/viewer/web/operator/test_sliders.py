"""Names and steps of sliders; the tests of the tab cover their behaviour."""

from __future__ import annotations

from cellwright.viewer.web.operator.feature import short_names, step_of
from cellwright.viewer.web.operator.robot_state import SeenJoint


def test_slider_steps_are_round_and_fine() -> None:
    assert step_of(SeenJoint("wheel", -6.28, 6.28, "rad")) == 0.01
    assert step_of(SeenJoint("tiny", 0.0, 1e-4, "m")) == 0.0001


def test_short_names_drop_common_first_words() -> None:
    assert short_names(["J_arm_r_01", "J_arm_r_02"]) == ["01", "02"]
    assert short_names(["right_elbow", "right_wrist_pitch"]) == ["elbow", "wrist_pitch"]
    assert short_names(["lift"]) == ["lift"]
    assert short_names(["a", "a_b"]) == ["a", "a_b"]
    assert short_names(["rh_FFJ4", "rh_THJ1"]) == ["FFJ4", "THJ1"]
