"""Names of the environments, and what is there without Gymnasium."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import pytest

from cellwright import envs
from cellwright.config.trial.catalogue import bundled_tasks
from cellwright.envs.registration import environment_id

WITHOUT = """
import sys
sys.modules["gymnasium"] = None  # as if it were not installed
import importlib.util
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "gymnasium" else real(name, *rest)
from cellwright import envs
print(envs.CellStepper.__name__)
try:
    envs.CellEnv
except Exception as error:
    print(error)
"""


def test_every_bundled_task_is_an_environment_of_its_name() -> None:
    assert bundled_tasks()
    for task in bundled_tasks():
        env = gymnasium.make(f"cellwright.envs:{environment_id(task)}", disable_env_checker=True)
        assert env.get_wrapper_attr("task") == task
        assert env.spec is not None
        assert env.spec.max_episode_steps is None  # the environment has its own end, which evaluations read
        env.close()


def test_another_version_is_refused_with_the_one_that_there_is() -> None:
    with pytest.raises(gymnasium.error.VersionNotFound, match="PickFromBin"):
        gymnasium.make("cellwright.envs:PickFromBin-v99")


def test_without_gymnasium_there_is_the_stepper_and_a_remedy() -> None:
    found = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=True, timeout=60)
    stepper, error = found.stdout.splitlines()
    assert stepper == "CellStepper"
    assert error == "environments: Gymnasium is not installed; run: pip install 'cellwright[gym]'"


def test_unknown_names_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'CellEnvironment'"):
        _ = envs.CellEnvironment
