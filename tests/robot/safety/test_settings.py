"""Safety settings of a node."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cellwright.robot.safety import SafetySettings
from cellwright.util.errors import UnknownNameError, UsageError

JOINTS = ("arm_1", "arm_2", "head")
OWN = np.array([3.0, 1.0, 100.0])


@pytest.mark.parametrize("name", ["silence", "start_guard", "resume_speed", "one_commander", "max_age", "tip_speed"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_numbers_have_to_be_above_0(name: str, value: float) -> None:
    with pytest.raises(UsageError, match=f"must be a finite number above 0 .got {value:g}."):
        SafetySettings(**{name: value})  # type: ignore[arg-type]


def test_a_speed_has_to_be_above_0() -> None:
    with pytest.raises(UsageError, match=r"max speed of arm_\* must be a finite number above 0 .got -1."):
        SafetySettings(max_speeds=(("arm_*", -1.0),))


def test_without_speeds_only_the_robot_itself_limits() -> None:
    assert SafetySettings().speeds(JOINTS, OWN).tolist() == [math.inf] * 3


def test_the_last_pattern_that_fits_counts_and_no_joint_is_faster_than_its_own() -> None:
    safety = SafetySettings(max_speeds=(("arm_*", 2.0), ("arm_1", 0.5)))
    assert safety.speeds(JOINTS, OWN).tolist() == [0.5, 1.0, math.inf]


def test_a_pattern_that_fits_nothing_is_an_error() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown joint 'arms_\*'"):
        SafetySettings(max_speeds=(("arms_*", 1.0),)).speeds(JOINTS, OWN)
