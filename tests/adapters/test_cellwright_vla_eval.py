"""Cellwright for vla-eval, which is not installed: seeds, observations, metrics, simulation time, lost servers."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from cellwright_env import EnvError

from cellwright import load_trial
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.served.server import EnvServer
from cellwright.envs.served.session import EnvSession
from tests.adapters.stand_ins import imported

TASK = "pick_from_bin"
MODULES = ("", ".benchmarks", ".benchmarks.base", ".specs")


@pytest.fixture(name="adapter", scope="module")
def made_adapter() -> Iterator[Any]:
    with imported("cellwright_vla_eval", *(f"vla_eval{each}" for each in MODULES)) as adapter:
        yield adapter


@pytest.fixture(name="server", scope="module")
def made_server() -> Iterator[EnvServer]:
    with closing(EnvServer(EnvSession(load_trial(TASK)))) as server:
        yield server


@pytest.fixture(name="benchmark")
def made_benchmark(adapter: Any, server: EnvServer) -> Iterator[Any]:
    benchmark = adapter.Cellwright((TASK, "reach"), seed=5, cameras=(), address=server.address)
    yield benchmark
    benchmark.cleanup()


def test_episodes_are_those_of_the_environment(benchmark: Any) -> None:
    task = {"name": TASK, "episode_idx": 2}
    with closing(CellEnv(TASK)) as env:
        expected, _ = env.reset(seed=7)
        observed = benchmark.make_obs(benchmark.reset(task), task)
        assert np.array_equal(observed["states"], expected["agent_pos"])
        expected, reward, *_ = env.step(expected["agent_pos"])
    result = benchmark.step({"actions": observed["states"]})
    assert np.array_equal(result.obs["agent_pos"], expected["agent_pos"])
    assert (result.reward, result.done) == (reward, False)
    assert asyncio.run(benchmark.get_time()) == 0.05


def test_observation_has_what_model_servers_ask_for(adapter: Any, server: EnvServer) -> None:
    task = {"name": TASK, "episode_idx": 0}
    for options, keys in (
        ({}, {"states"}),
        ({"send_state": False}, set()),
        ({"privileged": True}, {"states", "environment_state"}),
    ):
        benchmark = adapter.Cellwright(cameras=(), address=server.address, **options)
        observed = benchmark.make_obs(benchmark.reset(task), task)
        assert observed.keys() == {"images", "task_description"} | keys
        assert observed["task_description"] == "Pick up a gear from the bin."
        benchmark.cleanup()


def test_wrist_image_is_that_of_the_camera_wrist(adapter: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {}

    def refuse(task: str, **options: Any) -> Any:
        asked.update(options)
        raise EnvError("request", "no")

    monkeypatch.setattr(adapter, "RemoteEnv", refuse)
    benchmark = adapter.Cellwright(send_wrist_image=True)
    with pytest.raises(EnvError):
        benchmark.reset({"name": TASK, "episode_idx": 0})
    assert asked["cameras"] == ("overhead", "wrist")
    assert benchmark.get_observation_spec().keys() == {"overhead", "wrist", "state", "language"}


def test_success_is_a_metric(benchmark: Any, adapter: Any) -> None:
    assert benchmark.get_metric_keys()["success"] == "mean"
    for info, success in (({}, False), ({"is_success": False}, False), ({"is_success": True}, True)):
        assert benchmark.get_step_result(adapter.StepResult(info=info)) == {"success": success}


def test_task_after_another_has_its_own_environment(benchmark: Any) -> None:
    assert [each["name"] for each in benchmark.get_tasks()] == [TASK, "reach"]
    for name in (TASK, "reach", TASK):
        benchmark.reset({"name": name, "episode_idx": 0})
        assert benchmark._env.task == name


def test_episode_after_the_loss_of_a_server_has_another_one(benchmark: Any) -> None:
    task = {"name": TASK, "episode_idx": 0}
    action = benchmark.reset(task)["agent_pos"]
    benchmark._env.close()
    with pytest.raises(EnvError, match="the environment is closed, or its server is gone"):
        benchmark.step({"actions": action})
    assert benchmark.reset(task)["agent_pos"].tolist() == action.tolist()


def test_refused_action_leaves_the_episode(benchmark: Any) -> None:
    with pytest.raises(EnvError, match="step: no episode has begun; call reset first"):
        benchmark.step({"actions": np.zeros(8)})
    observed = benchmark.reset({"name": TASK, "episode_idx": 0})
    with pytest.raises(EnvError, match="must have 8 numbers"):
        benchmark.step({"actions": np.zeros(7)})
    assert not benchmark.step({"actions": observed["agent_pos"]}).done
