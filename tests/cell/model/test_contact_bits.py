"""Contact bits of arms and robots: each touches the others, and not itself."""

from typing import Any

import pytest

from cellwright.cell.model.build import build_world
from cellwright.config.trial.gear2017 import load_trial
from cellwright.engine.shapes import Touch
from tests.cell.arm_cells import TWO_ON_A_RAIL
from tests.cell.robot_cells import BESIDE_ARM

ROBOTS = """
    one: {model: tandem, at: [-2, 0, 0], namespace: one}
    two: {model: tandem, at: [-2, 2, 0], namespace: two}
"""
TWO_AND_TWO = TWO_ON_A_RAIL.replace("cell:\n", f"cell:\n  robots:{ROBOTS}")


def bits(model: Any, body: str) -> tuple[int, int]:
    """Return contype and conaffinity of the shapes of a body that touch anything, which are the same for all."""
    first, count = int(model.body(body).geomadr[0]), int(model.body(body).geomnum[0])
    found = {(int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])) for geom in range(first, first + count)}
    (pair,) = (pair for pair in found if any(pair))
    return pair


def touch(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether shapes with these bits touch, by the engine's rule."""
    return bool(one[0] & other[1] or other[0] & one[1])


@pytest.mark.parametrize("names", [("arm1/forearm_link", "one/torso"), ("one/right_hand", "two/head")])
def test_each_of_arms_and_robots_touches_the_others_and_what_stands_around(names: tuple[str, str]) -> None:
    model = build_world(load_trial(text=TWO_AND_TWO).trial).model
    one, other = (bits(model, name) for name in names)
    assert touch(one, other)
    for own in (one, other):
        assert not touch(own, own)
        assert touch(own, Touch.PART.value)
        assert touch(own, Touch.FIXED.value)
    assert bits(model, "one/right_hand") == bits(model, "one/torso")


def test_beam_touches_robots_and_no_arm() -> None:
    model = build_world(load_trial(text=TWO_AND_TWO).trial).model
    beam = bits(model, "arm1/linear_arm_actuator")
    assert touch(beam, bits(model, "two/torso"))
    assert not touch(beam, bits(model, "arm2/forearm_link"))


def test_arm_beside_a_robot_touches_it() -> None:
    model = build_world(load_trial(text=BESIDE_ARM).trial).model
    assert touch(bits(model, "forearm_link"), bits(model, "tandem/torso"))
    assert not touch(bits(model, "forearm_link"), bits(model, "linear_arm_actuator"))
