"""A rearranged model is the one that would be built, number for number."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright import load_trial
from cellwright.cell.model.build import World, build_world
from cellwright.cell.model.rearrangement import rearrange
from cellwright.cell.variation import vary
from cellwright.config.trial.catalogue import bundled
from cellwright.config.trial.trial import Trial
from tests.support.cells import WHOLE
from tests.support.own_parts import PARTS, write_trial


def trial_of(name: str) -> Trial:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # notes for the files' author
        return load_trial(name)


def arrays(world: World) -> dict[str, Any]:
    model = world.model
    found = {name: getattr(model, name) for name in dir(model) if not name.startswith("_")}
    found |= {"initial_qpos": world.initial_qpos, "initial_ctrl": world.initial_ctrl}
    found |= {"inertia": np.array(model.stat.meaninertia), "extent": np.array(model.stat.extent)}
    return {name: value.tobytes() for name, value in found.items() if isinstance(value, np.ndarray)}


def assert_rearranges(written: Trial) -> None:
    posture = {"elbow_joint": 1.0, "linear_arm_actuator_joint": -0.5} if written.has_arm else {}
    varied = replace(vary(written, 7), initial_joint_states=posture)
    world = build_world(written)
    before = arrays(world)
    for trial in (varied, written):
        world = rearrange(world, trial)
        built = build_world(trial)
        assert arrays(world) == arrays(built)
        assert world.parts == built.parts
    assert arrays(world) == before
    assert arrays(build_world(varied)) != before  # else the comparison would show nothing


def test_rearranged_model_equals_built_one() -> None:
    assert_rearranges(WHOLE)


def test_rearranged_model_of_own_parts_equals_built_one(tmp_path: Path) -> None:
    assert_rearranges(load_trial(write_trial(tmp_path, *list(PARTS)[:4])))


@pytest.mark.slow
@pytest.mark.parametrize("name", bundled())
def test_rearranged_model_of_bundled_trial_equals_built_one(name: str) -> None:
    assert_rearranges(trial_of(name))
