"""The client of a served environment: its MessagePack, an environment as of Gymnasium, and the life of its server."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import websockets
from cellwright_env import EnvError, RemoteEnv, pack, unpack
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given
from hypothesis import strategies as st

from cellwright import load_trial
from cellwright.clients.policies import codec
from cellwright.clients.policies.array_forms import OPENPI
from cellwright.config.trial.catalogue import bundled_tasks
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.served.server import EnvServer
from cellwright.envs.served.session import EnvSession
from tests.adapters.conftest import CLIENT
from tests.support.processes import Process, is_running
from tests.support.waiting import wait_until

TASK = "pick_from_bin"

_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False)
    | st.text(max_size=40)
    | st.binary(max_size=300),
    lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(max_size=5), inner, max_size=20),
    max_leaves=30,
)
_ARRAYS = [
    np.array([[0.5, -1]], np.float32),
    np.zeros((0, 3), np.uint8),
    np.array(3, np.int32),
    np.array([True]),
    np.eye(3)[:, 1],
]


@pytest.fixture(name="server", scope="module")
def made_server() -> Iterator[EnvServer]:
    with closing(EnvServer(EnvSession(load_trial(TASK)))) as server:
        yield server


@pytest.fixture(name="env")
def made_env(server: EnvServer) -> Iterator[RemoteEnv]:
    with RemoteEnv(TASK, address=server.address) as env:
        yield env


@given(_VALUES)
def test_values_pass_both_ways(value: object) -> None:
    assert codec.unpack(pack(value), OPENPI) == value
    assert unpack(codec.pack(value, OPENPI)) == value


@pytest.mark.parametrize("array", _ARRAYS, ids=lambda each: f"{each.dtype}{each.shape}")
def test_arrays_pass_both_ways(array: Any) -> None:
    for there in (codec.unpack(pack({"a": array}), OPENPI), unpack(codec.pack({"a": array}, OPENPI))):
        assert isinstance(there, dict)
        assert there["a"].dtype == array.dtype
        assert np.array_equal(there["a"], array)
    assert unpack(codec.pack(np.float32(1.5), OPENPI)) == np.float32(1.5)
    assert pack(np.int64(-2)) == pack(-2)


def test_only_plain_values_are_packed(env: RemoteEnv) -> None:
    for wrong in ({"a": object()}, {"a": np.array(["x"])}, {"a": 2**64}):
        with pytest.raises(EnvError, match="reset: cannot be sent") as raised:
            env.reset(options=wrong)
        assert raised.value.kind == "request"
    assert env.reset(seed=1)[1]["time"] == 0.0


def test_episodes_are_those_of_the_environment(env: RemoteEnv) -> None:
    with closing(CellEnv(TASK)) as own:
        first = own.reset(seed=5)
        action = first[0]["agent_pos"]
        assert data_equivalence(env.reset(seed=5), first, exact=True)
        assert data_equivalence(env.step(action), own.step(action), exact=True)
        steps = [own.step(action) for _ in range(3)]
    observation, rewards, terminated, truncated, info = env.step_chunk([action] * 3)
    assert data_equivalence([observation, terminated, truncated, info], [steps[-1][0], *steps[-1][2:]], exact=True)
    assert rewards.tolist() == [each[1] for each in steps]


def test_what_a_learner_reads_beside_the_steps(env: RemoteEnv) -> None:
    assert env.task == TASK
    assert env.task_description == "Pick up a gear from the bin."
    assert env._max_episode_steps == 400
    assert env.metadata == {"render_modes": ["rgb_array"], "render_fps": 20.0}
    assert env.description["action"]["low"].shape == (8,)


def test_a_client_of_a_server_that_runs_chooses_its_task(server: EnvServer) -> None:
    other = next(each for each in bundled_tasks() if each != TASK)
    with RemoteEnv(other, address=server.address) as env:
        assert env.task == other
    with pytest.raises(EnvError, match="unknown task 'pick_from_bim'; did you mean pick_from_bin"):
        RemoteEnv("pick_from_bim", address=server.address)


def test_what_the_server_refuses_is_an_error_of_its_kind(env: RemoteEnv) -> None:
    with pytest.raises(EnvError, match="send reset first") as raised:
        env.step(np.zeros(8))
    assert raised.value.kind == "request"
    with pytest.raises(EnvError, match="action: must have one axis"):
        env.step(np.zeros((2, 8)))
    with pytest.raises(EnvError, match="actions: must have two axes"):
        env.step_chunk(np.zeros(8))
    env.close()
    env.close()
    with pytest.raises(EnvError, match="the environment is closed, or its server is gone") as raised:
        env.reset()
    assert raised.value.kind == "connection"


@pytest.mark.slow
def test_a_server_that_cannot_be_started_says_why() -> None:
    with pytest.raises(EnvError, match="unknown trial 'pick_from_bim'"):
        RemoteEnv("pick_from_bim")
    with pytest.raises(EnvError, match=r"/no/python: cannot be started \(No such file"):
        RemoteEnv(TASK, python="/no/python")
    with pytest.raises(EnvError, match=r"ws://127.0.0.1:1: cannot be reached"):
        RemoteEnv(TASK, address="ws://127.0.0.1:1")


@pytest.mark.slow
def test_a_server_of_its_own_leaves_out_the_privileged_state() -> None:
    with RemoteEnv(TASK, privileged=False) as env:
        observation, _ = env.reset(seed=5)
    assert list(observation) == ["agent_pos"]


@pytest.mark.slow
def test_numpy_and_websockets_are_enough_and_the_server_ends_with_its_program(tmp_path: Path) -> None:
    packages = tmp_path / "packages"
    packages.mkdir()
    for module in (np, websockets):
        home = Path(module.__file__ or "").parent
        for folder in (home, home.with_name(f"{home.name}.libs")):
            if folder.is_dir():
                (packages / folder.name).symlink_to(folder)
    program = str(Path(__file__).with_name("alone.py"))
    command = [sys.executable, "-I", "-S", program, sys.executable, str(CLIENT), str(packages)]
    ran = Process(command, os.environ, tmp_path)
    assert ran.finish() == 1, ran.err
    said = json.loads(ran.out)
    assert said["loaded"] == []
    with closing(CellEnv(TASK)) as env:
        observation, *rest = env.step(env.reset(seed=5)[0]["agent_pos"])
    assert said["reported"] == [observation["environment_state"].tolist(), *rest]
    wait_until(lambda: not is_running(said["server"]), "end of the server")
