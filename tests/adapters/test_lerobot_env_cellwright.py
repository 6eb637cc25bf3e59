"""Environments for LeRobot: how LeRobot finds them, the features that it asks for, and what it makes of them."""

from __future__ import annotations

import importlib
import sys
import tomllib
from collections.abc import Iterator
from contextlib import closing
from typing import Any
from unittest import mock

import pytest
from cellwright_vector import RemoteVectorEnv, description

from cellwright import load_trial
from cellwright.config.trial.catalogue import bundled_tasks
from cellwright.envs.served.server import EnvServer
from cellwright.envs.served.session import EnvSession
from tests.adapters import lerobot_stand_in
from tests.adapters.conftest import ADAPTERS

FOLDER = ADAPTERS / "lerobot_env_cellwright"


@pytest.fixture(name="adapter", scope="module")
def imported() -> Any:
    with mock.patch.dict(sys.modules, lerobot_stand_in.modules()):
        return importlib.import_module(FOLDER.name)


@pytest.fixture(name="config")
def registered(adapter: Any) -> Any:
    return lerobot_stand_in.KNOWN["cellwright"]


@pytest.fixture(name="address")
def served() -> Iterator[str]:
    description.cache_clear()
    with closing(EnvServer(EnvSession(load_trial("pick_from_bin"), cameras=("overhead",)))) as server:
        yield server.address


def test_distribution_has_the_name_that_lerobot_looks_for_and_the_module_of_that_name() -> None:
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text())
    name = project["project"]["name"]
    assert name.startswith("lerobot_env_")  # with underscores, as spelt
    assert f"{name}.py" in project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"]
    for each in project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"]:
        assert (FOLDER / each).is_file()


def test_features_are_those_of_the_served_environment(config: Any, address: str) -> None:
    found = config(address=address)
    assert {name: (each.type.value, each.shape) for name, each in found.features.items()} == {
        "action": ("ACTION", (8,)),
        "agent_pos": ("STATE", (8,)),
        "environment_state": ("ENV", (16,)),
        "observation.images.overhead": ("VISUAL", (84, 84, 3)),
    }
    assert found.features_map == {
        "action": "action",
        "agent_pos": "observation.state",
        "environment_state": "observation.environment_state",
        "observation.images.overhead": "observation.images.overhead",
    }
    assert found.fps == 20
    assert found.gym_kwargs == {}


@pytest.mark.parametrize("task", bundled_tasks())
def test_each_bundled_task_has_features_and_environments(config: Any, address: str, task: str) -> None:
    found = config(task=task, address=address)
    assert found.features_map.keys() == found.features.keys()
    ((suite, numbered),) = found.create_envs(n_envs=1, use_async_envs=True).items()
    with closing(numbered[0]) as envs:
        assert (suite, *envs.call("task")) == (task, task)
        assert envs.single_action_space.shape == found.features["action"].shape


def test_options_are_those_of_the_server_that_is_started(
    adapter: Any, config: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    described = {"rate": 50.0, "action": {"shape": [8]}, "observation": {}}
    asked = mock.create_autospec(description, return_value=described)
    monkeypatch.setattr(adapter, "description", asked)
    config(task="reach", fps=50, control="delta", cameras="overhead, wrist", python="/opt/python")
    options = {"rate": 50.0, "control": "delta", "cameras": ("overhead", "wrist")}
    asked.assert_called_once_with("reach", python="/opt/python", address=None, **options)


def test_environments_are_made_for_the_asked_number(adapter: Any, config: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made = mock.create_autospec(RemoteVectorEnv)
    monkeypatch.setattr(adapter, "RemoteVectorEnv", made)
    monkeypatch.setattr(
        adapter, "description", lambda *_, **__: {"rate": 20.0, "action": {"shape": [8]}, "observation": {}}
    )
    config(python="/opt/python").create_envs(4)
    options = {"rate": 20.0, "control": "absolute", "cameras": (), "python": "/opt/python", "address": None}
    made.assert_called_once_with("pick_from_bin", 4, **options)
