"""Vectors of environments: Gymnasium's, in one process and in several, and many cells in one process give the same."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from cellwright import load_trial
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.vector import NEW_ROLLOUT, CellVectorEnv
from cellwright.util.errors import UsageError
from tests.envs.stories import COUNT, ID, story


def short(**options: Any) -> Callable[[], CellEnv]:
    """Return a maker of environments with episodes of three steps."""
    return partial(CellEnv, replace(load_trial("pick_from_bin"), time_limit=0.15), **options)


def many(**options: Any) -> CellVectorEnv:
    return CellVectorEnv(replace(load_trial("pick_from_bin"), time_limit=0.15), COUNT, **options)


@pytest.mark.slow
def test_one_process_several_and_many_cells_tell_the_same() -> None:
    one = story(SyncVectorEnv([partial(gymnasium.make, ID)] * COUNT))
    program = [sys.executable, "-m", "tests.envs.async_program"]
    several = pickle.loads(subprocess.run(program, check=True, capture_output=True, timeout=120).stdout)
    cells = story(gymnasium.make_vec(ID, num_envs=COUNT, vectorization_mode="vector_entry_point"))
    assert data_equivalence(one, several, exact=True)
    assert data_equivalence(one, cells, exact=True)


def test_pictures_of_many_cells_are_those_of_single_ones() -> None:
    cameras = {"cameras": ("overhead", "wrist"), "control": "delta"}
    cells = story(many(**cameras), 2)
    assert cells[0][0]["pixels"]["wrist"].shape == (COUNT, 84, 84, 3)
    assert data_equivalence(story(SyncVectorEnv([short(**cameras)] * COUNT), 2), cells, exact=True)


def test_the_step_after_an_end_begins_the_next_episode() -> None:
    one, cells = story(SyncVectorEnv([short()] * COUNT), 6), story(many(), 6)
    assert data_equivalence(one, cells, exact=True)
    assert [step[3].tolist() for step in cells[1:]] == [[False] * 2, [False] * 2, [True] * 2] + [[False] * 2] * 3
    assert cells[4][4]["time"].tolist() == [0.0, 0.0]


def test_after_the_option_of_lerobot_an_ended_episode_stands_still_until_a_reset() -> None:
    envs = many()
    with closing(envs):
        observations, _ = envs.reset(seed=1, options={NEW_ROLLOUT: True})
        steps = [envs.step(observations["agent_pos"]) for _ in range(6)]
        assert data_equivalence(steps[2][0], steps[5][0], exact=True)
        for _, rewards, _, truncations, infos in steps[3:]:
            assert rewards.tolist() == [0.0, 0.0]
            assert truncations.tolist() == [True, True]
            assert infos["time"].tolist() == pytest.approx([0.15, 0.15])
        _, infos = envs.reset(seed=1)
        assert infos["time"].tolist() == [0.0, 0.0]


def test_a_mask_resets_some_and_leaves_the_others() -> None:
    envs = many()
    with closing(envs):
        with pytest.raises(UsageError, match="the first reset is one of all environments"):
            envs.reset(options={"reset_mask": np.array([True, False])})
        first, _ = envs.reset(seed=1)
        later, *_ = envs.step(first["agent_pos"])
        mixed, infos = envs.reset(seed=[None, 2], options={"reset_mask": np.array([False, True])})
        assert np.array_equal(mixed["environment_state"][0], later["environment_state"][0])
        assert np.array_equal(mixed["environment_state"][1], first["environment_state"][1])
        assert infos["_time"].tolist() == [False, True]
        for mask in (np.array([False, False]), np.array([1, 0]), np.array([True])):
            with pytest.raises(UsageError, match="reset_mask: must be 2 booleans, one of them True"):
                envs.reset(options={"reset_mask": mask})


def test_what_an_evaluation_asks_of_a_vector() -> None:
    envs = many()
    with closing(envs):
        assert envs.call("_max_episode_steps") == (3, 3)
        assert set(envs.call("task_description")) == {"Pick up a gear from the bin."}
        assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
        assert envs.render_mode is None


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(UsageError, match=r"num_envs: must be at least 1 \(got 0\)"):
        CellVectorEnv("pick_from_bin", 0)
    envs = many()
    with closing(envs):
        with pytest.raises(UsageError, match=r"one for each of 2 environments \(got 3\)"):
            envs.reset(seed=[1, 2, 3])
        envs.reset(seed=1)
        with pytest.raises(UsageError, match=r"actions: must have the shape \(2, 8\) \(got \(8,\)\)"):
            envs.step(np.zeros(8))
