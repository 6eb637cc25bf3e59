"""The vector of served environments: its episodes are those of cells in this process, and its servers end with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import cellwright_vector
import numpy as np
import pytest
from cellwright_env import EnvError, RemoteEnv
from cellwright_vector import NEW_ROLLOUT, RemoteVectorEnv, description
from gymnasium.utils.env_checker import data_equivalence

from cellwright import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.envs.served.server import EnvServer
from cellwright.envs.served.session import EnvSession
from cellwright.envs.vector import CellVectorEnv
from tests.envs.stories import COUNT, story
from tests.support.processes import is_running

TASK = "pick_from_bin"
SHORT = replace(load_trial(TASK), time_limit=0.15)


@pytest.fixture(name="serve")
def made_servers(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., list[EnvServer]]]:
    """Return a function after which each environment has a server of a trial in this process; it returns these."""
    servers: list[EnvServer] = []

    def serve(trial: Trial = SHORT, **options: Any) -> list[EnvServer]:
        def started(task: str) -> RemoteEnv:
            server = EnvServer(EnvSession(trial, **options))
            servers.append(server)
            return RemoteEnv(task, address=server.address)

        monkeypatch.setattr(cellwright_vector, "RemoteEnv", started)
        return servers

    description.cache_clear()
    yield serve
    description.cache_clear()
    for each in servers:
        each.close()


def test_steps_after_an_end_are_those_of_cells_in_one_process(serve: Callable[..., list[EnvServer]]) -> None:
    serve()
    assert data_equivalence(story(RemoteVectorEnv(TASK, COUNT), 6), story(CellVectorEnv(SHORT, COUNT), 6), exact=True)


def test_pictures_and_spaces_are_those_of_cells_in_one_process(serve: Callable[..., list[EnvServer]]) -> None:
    options: dict[str, Any] = {"cameras": ("overhead", "wrist"), "control": "delta", "rate": 10}
    serve(**options)
    remote, cells = RemoteVectorEnv(TASK, COUNT), CellVectorEnv(SHORT, COUNT, **options)
    spaces: list[Any] = [remote.single_observation_space, cells.single_observation_space]
    assert remote.single_action_space == cells.single_action_space
    assert [*spaces[0]] == [*spaces[1]]
    assert spaces[0]["pixels"] == spaces[1]["pixels"]
    assert (type(remote.metadata["render_fps"]), remote.metadata["render_fps"]) == (int, 10)
    assert data_equivalence(story(remote, 1), story(cells, 1), exact=True)


def test_after_the_option_of_lerobot_an_ended_episode_stands_still_until_a_reset(
    serve: Callable[..., list[EnvServer]],
) -> None:
    serve()
    with closing(RemoteVectorEnv(TASK, COUNT)) as remote, closing(CellVectorEnv(SHORT, COUNT)) as cells:
        stories: list[Any] = []
        for envs in (remote, cells):
            observations, _ = envs.reset(seed=[3, 4], options={NEW_ROLLOUT: True})
            steps = [envs.step(observations["agent_pos"]) for _ in range(5)]
            stories.append([*steps, envs.reset(seed=7)])
        assert data_equivalence(stories[0], stories[1], exact=True)
        assert stories[0][4][1].tolist() == [0.0, 0.0]
        assert stories[0][4][3].tolist() == [True, True]


def test_what_lerobot_asks_of_each_environment(serve: Callable[..., list[EnvServer]]) -> None:
    serve()
    with closing(RemoteVectorEnv(TASK, COUNT)) as envs:
        assert envs.call("_max_episode_steps") == (3, 3)
        assert envs.call("task_description") == ("Pick up a gear from the bin.",) * 2
        assert envs.get_attr("task") == (TASK, TASK)
        _, infos = envs.reset(seed=1)
        assert infos["is_success"].tolist() == [False, False]
        assert infos["is_success"].dtype == np.bool_
        _, _, _, _, infos = envs.step(np.zeros((2, 8)))
        assert infos["is_success"].tolist() == [False, False]


def test_servers_start_with_the_first_reset(serve: Callable[..., list[EnvServer]]) -> None:
    servers = serve()
    with closing(RemoteVectorEnv(TASK, COUNT)) as envs:
        assert len(servers) == 1  # for the description
        with pytest.raises(EnvError, match="step: no episode has begun; call reset first"):
            envs.step(np.zeros((2, 8)))
        envs.reset()
        assert len(servers) == 1 + COUNT


def test_wrong_numbers_of_seeds_actions_and_environments_are_refused(serve: Callable[..., list[EnvServer]]) -> None:
    serve()
    with closing(RemoteVectorEnv(TASK, COUNT)) as envs:
        with pytest.raises(ValueError, match=r"seed: must be one number, or 2 of them \(got 3\)"):
            envs.reset(seed=[1, 2, 3])
        envs.reset(seed=1)
        with pytest.raises(ValueError, match=r"actions: must be 2 rows \(got 1\)"):
            envs.step(np.zeros((1, 8)))
    envs.close()
    with pytest.raises(EnvError, match=r"ws://h:1: has one client \(got 2 environments\); leave the address out"):
        RemoteVectorEnv(TASK, COUNT, address="ws://h:1")


@pytest.mark.slow
def test_servers_are_processes_that_end_with_the_vector() -> None:
    description.cache_clear()
    envs = RemoteVectorEnv(TASK, COUNT)
    first, _ = envs.reset(seed=3)
    processes = [process.pid for process in envs.get_attr("_process")]
    assert all(map(is_running, processes))
    assert not np.array_equal(first["environment_state"][0], first["environment_state"][1])
    envs.close()
    assert not any(map(is_running, processes))


@pytest.mark.slow
def test_a_server_that_cannot_be_started_says_why() -> None:
    with pytest.raises(EnvError, match="unknown trial 'pick_from_bim'"):
        RemoteVectorEnv("pick_from_bim")
    envs = RemoteVectorEnv(TASK, COUNT)
    envs._made = partial(RemoteEnv, TASK, python="/no/python")
    with pytest.raises(EnvError, match=r"/no/python: cannot be started"):
        envs.reset()
