"""Session of a served environment: equal to the environment, bit for bit; what it refuses changes nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from cellwright import load_trial
from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import pack, unpack
from cellwright.config.trial.catalogue import bundled_tasks
from cellwright.envs.cell_env import CellEnv
from cellwright.envs.served.session import EnvSession
from cellwright.util.errors import SimulationError, UnknownNameError

TASK = "pick_from_bin"


@pytest.fixture(name="session", scope="module")
def made_session() -> Iterator[EnvSession]:
    with closing(EnvSession(load_trial(TASK))) as session:
        yield session


@pytest.fixture(autouse=True)
def new_client(session: EnvSession) -> None:
    ask(session, "hello", task=TASK)
    session.forget()


def ask(session: EnvSession, kind: str, **fields: Any) -> dict[str, Any]:
    reply = unpack(session.reply(pack({"type": kind, **fields}, OPENPI)).frame, OPENPI)
    assert isinstance(reply, dict)
    assert reply["type"] in (kind, "error")
    return reply


def refused(session: EnvSession, kind: str, **fields: Any) -> tuple[str, str]:
    reply = ask(session, kind, **fields)
    assert reply["type"] == "error"
    return reply["kind"], reply["error"]


@pytest.mark.parametrize("control", ["absolute", "delta"])
def test_replies_are_those_of_the_environment_bit_for_bit(control: Any) -> None:
    options = {"joints": {"elbow_joint": 1.2}}
    with (
        closing(EnvSession(load_trial(TASK), control=control)) as session,
        closing(CellEnv(TASK, control=control)) as env,
    ):
        observation, info = env.reset(seed=5, options=options)
        began = ask(session, "reset", seed=5, options=options)
        assert data_equivalence([observation, info], [began["observation"], began["info"]], exact=True)
        env.action_space.seed(1)
        for _ in range(4):
            action = env.action_space.sample()
            *expected, info = env.step(action)
            reply = ask(session, "step", action=action)
            names = ("observation", "reward", "terminated", "truncated")
            assert data_equivalence([*expected, info], [*(reply[each] for each in names), reply["info"]], exact=True)


def test_a_chunk_is_its_steps(session: EnvSession) -> None:
    first = ask(session, "reset", seed=3)["observation"]["agent_pos"]
    actions = first + np.linspace(0, 0.05, 4)[:, None].astype(np.float32)
    steps = [ask(session, "step", action=action) for action in actions]
    ask(session, "reset", seed=3)
    chunk = ask(session, "step", action=actions)
    assert chunk["executed"] == 4
    assert chunk["rewards"].tolist() == [each["reward"] for each in steps]
    assert "reward" not in chunk
    assert data_equivalence(chunk["observation"], steps[-1]["observation"], exact=True)
    assert chunk["info"] == steps[-1]["info"]


def test_a_chunk_stops_where_the_episode_is_over() -> None:
    with closing(EnvSession(replace(load_trial(TASK), time_limit=0.2))) as session:
        first = ask(session, "reset", seed=1)["observation"]["agent_pos"]
        reply = ask(session, "step", action=np.tile(first, (9, 1)))
        assert (reply["executed"], reply["terminated"], reply["truncated"]) == (4, False, True)
        assert reply["info"]["time"] == pytest.approx(0.2)
        kind, error = refused(session, "step", action=first)
        assert (kind, error) == ("request", "step: no episode has begun, or it is over; send reset first")
        assert ask(session, "reset")["info"]["time"] == 0.0


def test_hello_says_what_the_environment_is(session: EnvSession) -> None:
    said = ask(session, "hello")
    assert said["protocol"] == 1
    assert said["task"] == TASK
    assert said["tasks"] == [TASK, *(each for each in bundled_tasks() if each != TASK)]
    assert (said["rate"], said["period"], said["max_steps"]) == (20.0, 0.05, 400)
    action, observed = said["action"], said["observation"]
    assert action["names"][-1] == "suction"
    assert (action["units"][-1], action["units"][-2]) == ("", "rad")
    assert (action["low"][-1], action["high"][-1]) == (0.0, 1.0)
    assert observed["agent_pos"]["shape"] == [8]
    assert len(observed["environment_state"]["names"]) == 16
    assert said["cameras"]
    assert "pixels" not in observed


def test_hello_of_changes_has_no_units_and_its_cameras() -> None:
    with closing(EnvSession(load_trial(TASK), control="delta", cameras=["overhead"])) as session:
        said = ask(session, "hello")
    assert set(said["action"]["units"]) == {""}
    assert set(said["observation"]["agent_pos"]["units"]) > {"rad"}
    assert set(said["observation"]["pixels"]) == {"overhead"}
    assert said["observation"]["pixels"]["overhead"]["dtype"] == "uint8"


def test_without_privileged_state_no_task_has_it() -> None:
    other = next(each for each in bundled_tasks() if each != TASK)
    with closing(EnvSession(load_trial(TASK), privileged=False)) as session:
        assert [list(ask(session, "hello", task=each)["observation"]) for each in (TASK, other)] == [["agent_pos"]] * 2


def test_a_client_chooses_another_task_by_its_name_alone(session: EnvSession) -> None:
    other = next(each for each in bundled_tasks() if each != TASK)
    ask(session, "reset", seed=1)
    kind, error = refused(session, "hello", task="/etc/passwd")
    assert kind == "request"
    assert error.startswith("unknown task '/etc/passwd'")
    assert ask(session, "step", action=[0.0] * 8)["type"] == "step"  # its episode goes on
    said = ask(session, "hello", task=other)
    assert said["task"] == other
    assert refused(session, "step", action=said["action"]["low"])[0] == "request"  # and is over with the task
    assert ask(session, "hello", task=TASK)["task"] == TASK


def test_what_is_refused_changes_nothing(session: EnvSession) -> None:
    action = ask(session, "reset", seed=4)["observation"]["agent_pos"]
    expected = ask(session, "step", action=action)
    ask(session, "reset", seed=4)
    assert refused(session, "step", action=[0.0]) == ("request", "step: action: must have 8 numbers (got 1)")
    kind, error = refused(session, "step", action=np.array([action, action * np.nan]))
    assert kind == "request"
    assert error.startswith("step: action: a number must be finite")
    assert "elbo" in refused(session, "reset", options={"joints": {"elbo": 1.0}})[1]
    assert refused(session, "render", size=1)[0] == "request"
    assert data_equivalence(ask(session, "step", action=action), expected, exact=True)


def test_an_unstable_episode_is_over_and_another_begins(session: EnvSession, monkeypatch: pytest.MonkeyPatch) -> None:
    action = ask(session, "reset", seed=4)["observation"]["agent_pos"]

    def unstable(_env: CellEnv, _action: Any) -> Any:
        raise SimulationError("the state is not finite")

    with monkeypatch.context() as patched:
        patched.setattr(CellEnv, "advance", unstable)
        assert refused(session, "step", action=action) == (
            "episode",
            "step: the state is not finite; begin another episode",
        )
    assert refused(session, "step", action=action)[0] == "request"
    ask(session, "reset", seed=4)
    assert ask(session, "step", action=action)["type"] == "step"


def test_the_next_client_sees_nothing_of_the_episode_before(session: EnvSession) -> None:
    action = ask(session, "reset", seed=4)["observation"]["agent_pos"]
    session.forget()
    assert "send reset first" in refused(session, "step", action=action)[1]
    assert "send reset first" in refused(session, "render")[1]


def test_a_picture_is_of_the_whole_cell(session: EnvSession) -> None:
    with closing(EnvSession(load_trial(TASK))) as own:
        ask(own, "reset", seed=1)
        picture = ask(own, "render")["picture"]
    assert picture.shape == (480, 640, 3)
    assert picture.dtype == np.uint8
    assert picture.std() > 1


def test_an_unknown_camera_is_refused_at_once() -> None:
    with pytest.raises(UnknownNameError, match="overhed"):
        EnvSession(load_trial(TASK), cameras=["overhed"])
