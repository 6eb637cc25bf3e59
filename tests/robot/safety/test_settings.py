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
def test_setting_not_above_0_is_refused(name: str, value: float) -> None:
    with pytest.raises(UsageError, match=f"must be a finite number above 0 .got {value:g}."):
        SafetySettings(**{name: value})  # type: ignore[arg-type]


def test_max_speed_not_above_0_is_refused() -> None:
    with pytest.raises(UsageError, match=r"max speed of arm_\* must be a finite number above 0 .got -1."):
        SafetySettings(max_speeds=(("arm_*", -1.0),))


def test_unknown_command_topic_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="/io_teleop/joint_cmd"):
        SafetySettings(command_topics=("/io_teleop/joint_cm",))


def test_speeds_without_max_speeds_are_infinite() -> None:
    assert SafetySettings().speeds(JOINTS, OWN).tolist() == [math.inf] * 3


def test_last_matching_pattern_counts_within_urdf_speed() -> None:
    safety = SafetySettings(max_speeds=(("arm_*", 2.0), ("arm_1", 0.5)))
    assert safety.speeds(JOINTS, OWN).tolist() == [0.5, 1.0, math.inf]


def test_pattern_without_match_is_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"unknown joint 'arms_\*'"):
        SafetySettings(max_speeds=(("arms_*", 1.0),)).speeds(JOINTS, OWN)
