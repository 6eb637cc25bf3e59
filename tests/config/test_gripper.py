"""Settings of a parallel gripper: defaults, and all that is out of bounds at once."""

from dataclasses import replace
from typing import Any

import pytest

from cellwright.config.gripper import BOUNDS, Pad, ParallelGripperSettings
from cellwright.util.errors import DescriptionError


def test_load_is_what_friction_bears() -> None:
    assert ParallelGripperSettings(force=30.0, pad=Pad(friction=0.5)).load == 15.0


@pytest.mark.parametrize("key", ["opening", "force", "speed"])
@pytest.mark.parametrize("outside", [0.0, 1e4, float("nan")])
def test_setting_out_of_bounds_is_refused_with_its_bounds(key: str, outside: float) -> None:
    lower, upper, unit = BOUNDS[key]
    settings: Any = {key: outside}
    with pytest.raises(DescriptionError) as caught:
        ParallelGripperSettings(**settings)
    assert caught.value.problems == (f"gripper: {key}: must be from {lower:g} to {upper:g} {unit} (got {outside:g})",)


@pytest.mark.parametrize("key", ["opening", "force", "speed"])
def test_bounds_themselves_are_allowed(key: str) -> None:
    for value in BOUNDS[key][:2]:
        settings: Any = {key: value}
        assert getattr(replace(ParallelGripperSettings(), **settings), key) == value


def test_pad_out_of_bounds_is_refused() -> None:
    with pytest.raises(DescriptionError) as caught:
        Pad((0.022, 0.5), friction=9.0)
    assert caught.value.problems == (
        "gripper: pad.size: must be from 0.005 to 0.2 m (got 0.5)",
        "gripper: pad.friction: must be from 0.05 to 3 (got 9)",
    )


def test_all_problems_are_reported_at_once() -> None:
    holds: Any = "glue"
    with pytest.raises(DescriptionError) as caught:
        ParallelGripperSettings(opening=3.0, speed=2.0, holds=holds)
    assert len(caught.value.problems) == 3
    assert "must be weld or friction (got 'glue')" in str(caught.value)
