"""Arms of a cell in the engine."""

from dataclasses import replace
from typing import Any

import pytest

from cellwright.cell.model.build import build_world
from cellwright.config.arm import JointGains
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Touch
from cellwright.util.errors import UnknownNameError
from tests.cell.arm_cells import TWO_ON_A_RAIL


def bits(model: Any, body: str) -> set[tuple[int, int]]:
    """Return contype and conaffinity of the shapes of a body that touch anything."""
    first, count = int(model.body(body).geomadr[0]), int(model.body(body).geomnum[0])
    found = ((int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])) for geom in range(first, first + count))
    return {pair for pair in found if any(pair)}


def touch(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether shapes with these bits touch, by the engine's rule."""
    return bool(one[0] & other[1] or other[0] & one[1])


def test_arms_touch_each_other_and_neither_themselves_nor_the_rail() -> None:
    model = build_world(load_trial(text=TWO_ON_A_RAIL).trial).model
    (first,), (second,) = (bits(model, f"{arm}/forearm_link") for arm in ("arm1", "arm2"))
    (beam,) = bits(model, "arm2/linear_arm_actuator")
    assert touch(first, second)
    assert not touch(first, first)
    assert not touch(first, beam)
    assert touch(first, Touch.PART.value)
    assert touch(second, Touch.FIXED.value)
    assert bits(model, "arm1/vacuum_gripper_link") == {first}


def test_only_arm_has_the_bits_of_a_robot() -> None:
    model = build_world(Trial("one", has_arm=True)).model
    assert bits(model, "forearm_link") == {Touch.ROBOT.value}


def test_setting_of_an_unknown_joint_is_refused() -> None:
    trial = Trial("one", has_arm=True)
    settings = replace(trial.settings, arm=replace(trial.settings.arm, gains={"elbow": JointGains(1.0, 0.0, 0.0, 0.0)}))
    with pytest.raises(UnknownNameError, match="unknown arm joint 'elbow'; did you mean elbow_joint"):
        build_world(replace(trial, settings=settings))
