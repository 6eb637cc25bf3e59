"""Cellwright for inspect-robots, which is not installed: spaces, seeds, endings, and what a policy is given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from cellwright_env import EnvError

from cellwright import load_trial
from cellwright.config.control import ControlSpace
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.served.server import EnvServer
from cellwright.envs.served.session import EnvSession
from tests.adapters.stand_ins import Record, imported

TASK = "pick_from_bin"
MODULES = ("", ".embodiment", ".scene", ".spaces", ".task", ".types")


@pytest.fixture(name="adapter", scope="module")
def made_adapter() -> Iterator[Any]:
    with imported("cellwright_inspect_robots", *(f"inspect_robots{each}" for each in MODULES)) as adapter:
        yield adapter


@pytest.fixture(name="server", scope="module")
def made_server() -> Iterator[EnvServer]:
    with closing(EnvServer(EnvSession(load_trial(TASK)))) as server:
        yield server


@pytest.fixture(name="embodiment")
def made_embodiment(adapter: Any, server: EnvServer) -> Iterator[Any]:
    with closing(adapter.Cellwright(TASK, address=server.address, privileged=True)) as embodiment:
        yield embodiment


def scene(**metadata: str) -> Record:
    return Record(id="one", instruction="Pick a gear.", metadata=metadata)


def test_no_step_within_the_bounds_is_limited(embodiment: Any) -> None:
    channels = ControlSpace.of(load_trial(TASK)).channels
    shape, low, high, semantics = embodiment.info.action_space.args
    assert shape == (8,)
    assert low.tolist() == [np.float32(each.low) for each in channels]
    assert high.tolist() == [np.float32(each.high) for each in channels]
    assert semantics.args == ("joint_pos",)
    assert semantics.gripper == "binary"
    assert semantics.dim_labels == tuple(each.name for each in channels)
    assert semantics.max_step == tuple((high - low).tolist())


def test_one_state_has_the_shape_of_an_action(embodiment: Any) -> None:
    (fields,) = embodiment.info.observation_space.state.args
    assert [each.args for each in fields] == [("joint_pos", (8,))]
    assert embodiment.info.control_hz == 20.0
    assert "- `suction`: 0 to 1" in embodiment.info.docs.splitlines()


def test_episodes_are_those_of_the_environment(embodiment: Any) -> None:
    with closing(CellEnv(TASK)) as env:
        expected, _ = env.reset(seed=5)
        observed = embodiment.reset(scene(), seed=5)
        assert np.array_equal(observed.state["joint_pos"], expected["agent_pos"])
        assert observed.instruction == "Pick a gear."
        assert observed.state_time == 0.0
        expected, reward, *_ = env.step(expected["agent_pos"])
        result = embodiment.step(Record(data=observed.state["joint_pos"]))
    assert np.array_equal(result.observation.extra["environment_state"], expected["environment_state"])
    assert (result.reward, result.terminated, result.termination_reason, result.truncated) == (
        reward,
        False,
        None,
        False,
    )
    assert result.info == {"is_success": False, "time": 0.05}
    assert result.observation.state_time == 0.05


@pytest.mark.parametrize(
    ("terminated", "is_success", "reason"), [(True, True, "success"), (True, False, "failure"), (False, False, None)]
)
def test_reason_of_an_end_says_whether_it_is_a_success(
    embodiment: Any, monkeypatch: pytest.MonkeyPatch, terminated: bool, is_success: bool, reason: str | None
) -> None:
    observation, info = embodiment._env.reset(seed=1)
    ended = (observation, 1.0, terminated, not terminated, {**info, "is_success": is_success})
    monkeypatch.setattr(embodiment._env, "step", lambda action: ended)
    result = embodiment.step(Record(data=np.zeros(8)))
    assert (result.terminated, result.termination_reason, result.truncated) == (terminated, reason, not terminated)


def test_privileged_state_is_given_only_where_it_is_asked_for(adapter: Any, server: EnvServer) -> None:
    with closing(adapter.Cellwright(TASK, address=server.address)) as embodiment:
        assert embodiment.reset(scene(), seed=1).extra == {}


def test_each_scene_has_a_seed_of_its_own(adapter: Any, server: EnvServer) -> None:
    task = adapter.task(TASK, episodes=3, seed=5, address=server.address)
    assert [(each.id, each.init_seed) for each in task.scenes] == [(f"{TASK}-{number}", number) for number in (5, 6, 7)]
    assert {each.instruction for each in task.scenes} == {"Pick up a gear from the bin."}
    assert (task.name, task.max_seconds, task.scorer) == (f"cellwright/{TASK}", 20.0, "success_at_end")


def test_scene_of_another_task_is_refused(embodiment: Any) -> None:
    with pytest.raises(ValueError, match=r"scene one: is of task reach \(got pick_from_bin\); give -E task=reach"):
        embodiment.reset(scene(cellwright_task="reach"), seed=1)


def test_cameras_are_named_by_commas(adapter: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, Any] = {}

    def refuse(task: str, **options: Any) -> Any:
        asked.update(options)
        raise EnvError("request", "no")

    monkeypatch.setattr(adapter, "RemoteEnv", refuse)
    with pytest.raises(EnvError):
        adapter.Cellwright(TASK, cameras="overhead, wrist", rate=10)
    assert (asked["cameras"], asked["rate"]) == (["overhead", "wrist"], 10.0)


def test_server_of_other_actions_is_refused(adapter: Any) -> None:
    session = EnvSession(load_trial(TASK), control="delta")
    with (
        closing(EnvServer(session)) as server,
        pytest.raises(ValueError, match=r"control: must be absolute \(got delta\)"),
    ):
        adapter.Cellwright(TASK, address=server.address)
