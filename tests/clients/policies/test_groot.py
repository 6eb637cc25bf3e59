"""Policies of GR00T, against a server on the loopback."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from threading import Event
from typing import Any

import numpy as np
import pytest

from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.groot import GrootPolicy
from cellwright.clients.policies.policy import (
    LookingBack,
    Policy,
    PolicyAnswerError,
    PolicyConnectionError,
    PolicyError,
)
from cellwright.clients.policies.sockets import KEY_VARIABLE, TIMEOUT
from tests.support.policy_servers import groot_server
from tests.support.ports import free_port

ARM = np.arange(32, dtype=np.float32).reshape(1, 16, 2)
HAND = np.ones((1, 16, 1), np.float32)
PICTURE = np.zeros((4, 6, 3), np.uint8)
OBSERVATION = {"video.front": PICTURE, "state.arm": np.zeros(2), "state.hand": 0.5, "language.task": "pick"}


def modality(keys: list[str], steps: list[int]) -> object:
    fields = {"delta_indices": steps, "modality_keys": keys, "sin_cos_embedding_keys": None}
    return {"__ModalityConfig_class__": True, "as_json": fields}


MODALITIES: dict[str, object] = {
    "video": modality(["front"], [0]),
    "state": modality(["arm", "hand"], [0]),
    "action": modality(["arm", "hand"], list(range(16))),
    "language": modality(["task"], [0]),
}


class Server:
    """Answers of GR00T's server, and the requests that it got."""

    def __init__(self, actions: object = None, **replies: object) -> None:
        self.asked: list[dict[str, Any]] = []
        self._replies: dict[str, object] = {
            "ping": {"status": "ok", "message": "Server is running"},
            "get_modality_config": MODALITIES,
            "reset": {},
            "get_action": [{"hand": HAND, "arm": ARM}, {}] if actions is None else actions,
        } | replies

    def answer(self, request: dict[str, Any]) -> object:
        self.asked.append(request)
        reply = self._replies[request["endpoint"]]
        return reply() if callable(reply) else reply


@contextmanager
def policy_at(server: Server, **options: Any) -> Iterator[GrootPolicy]:
    with groot_server(server.answer) as address, closing(GrootPolicy(address, **options)) as policy:
        yield policy


def test_observation_gets_batch_and_time_and_parts_are_joined_in_order() -> None:
    server = Server()
    with policy_at(server, actions=ActionFormat(3)) as policy:
        assert isinstance(policy, Policy)
        assert policy.metadata["state"]["modality_keys"] == ["arm", "hand"]  # type: ignore[index]
        policy.reset(1, "pick")
        answer = policy.infer(OBSERVATION)
        nested = {
            "video": {"front": PICTURE},
            "state": {"arm": [0.0, 0.0], "hand": [0.5]},
            "language": {"task": "pick"},
        }
        assert policy.infer(nested).request_sha256 == answer.request_sha256
    assert np.array_equal(answer.actions, np.concatenate([ARM[0], HAND[0]], axis=1))
    assert answer.infer_ms is None
    assert [each["endpoint"] for each in server.asked[:4]] == ["ping", "get_modality_config", "reset", "get_action"]
    assert server.asked[2]["data"] == {"options": None}
    sent = server.asked[3]["data"]["observation"]
    assert sent["video"]["front"].shape == (1, 1, 4, 6, 3)
    assert sent["state"]["arm"].dtype == np.float32
    assert sent["state"]["arm"].shape == (1, 1, 2)
    assert sent["state"]["hand"].tolist() == [[[0.5]]]
    assert sent["language"] == {"task": [["pick"]]}


def test_earlier_observations_are_those_of_their_periods() -> None:
    server = Server(get_modality_config=MODALITIES | {"video": modality(["front"], [-2, 0])})
    with policy_at(server) as policy:
        assert isinstance(policy, LookingBack)
        assert policy.history == 2
        for _ in range(2):  # a new episode knows nothing of the one before
            policy.reset(1, "pick")
            policy.see(OBSERVATION | {"video.front": PICTURE + 1})
            for number in (2, 3, 4):
                policy.infer(OBSERVATION | {"video.front": PICTURE + number})
    sent = [each["data"]["observation"] for each in server.asked if each["endpoint"] == "get_action"]
    assert {each["video"]["front"].shape for each in sent} == {(1, 2, 4, 6, 3)}
    assert [each["video"]["front"][0, :, 0, 0, 0].tolist() for each in sent] == [[1, 2], [1, 3], [2, 4]] * 2
    assert sent[0]["state"]["arm"].shape == (1, 1, 2)


def test_wrapper_for_simulators_has_flat_keys() -> None:
    server = Server([{"action.arm": ARM, "action.hand": HAND}, {}])
    with policy_at(server, dialect="groot-sim") as policy:
        assert policy.infer(OBSERVATION).actions.shape == (16, 3)
    sent = server.asked[-1]["data"]["observation"]
    assert sent.keys() == {"video.front", "state.arm", "state.hand", "task"}
    assert sent["task"] == ["pick"]


def test_keys_of_the_map_choose_parts() -> None:
    with policy_at(Server(), actions=ActionFormat(1, ("hand",))) as policy:
        assert np.array_equal(policy.infer(OBSERVATION).actions, HAND[0])


def test_key_of_the_environment_is_the_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(KEY_VARIABLE, "k1")
    server = Server()
    with policy_at(server):
        pass
    assert {each["api_token"] for each in server.asked} == {"k1"}


@pytest.mark.parametrize(
    ("actions", "problem"),
    [
        ({"error": "no\nmodel"}, r"the policy failed: no\\nmodel"),
        (b"ERROR", "the server answers ERROR"),
        (b"\xc1", "byte 0: no value of this wire"),
        ([{"arm": ARM}], "an answer must be a pair of actions and info"),
        ([{"arm": ARM}, {}], "the reply: it must have hand of its action keys .got the keys arm"),
        ([{"arm": ARM, "hand": np.zeros((2, 16, 1))}, {}], "actions/hand: its shape must be"),
        ([{"arm": {"__ndarray_class__": True, "as_npy": b"x"}}, {}], r"\[0\]/arm: not a .npy file of numpy"),
    ],
    ids=range(7),
)
def test_answer_that_is_no_chunk_names_the_server(actions: object, problem: str) -> None:
    with policy_at(Server(actions)) as policy, pytest.raises(PolicyAnswerError, match=rf"^tcp://127[^ ]*: {problem}"):
        policy.infer(OBSERVATION)


@pytest.mark.parametrize(
    ("modalities", "problem"),
    [
        ([], "no policy of GR00T: it has no modality action, state, video"),
        ({}, "no policy of GR00T: it has no modality action, state, video"),
        (MODALITIES | {"state": {}}, "modality state: it must have lists modality_keys and delta_indices"),
        (MODALITIES | {"state": modality([1], [0])}, "modality state: it must have lists"),  # type: ignore[list-item]
        (
            MODALITIES | {"video": modality(["front"], [0, 1])},
            r"modality video: its delta_indices must be 1 to 16 whole numbers from -600 to 0 \(got \[0, 1\]\)",
        ),
        (MODALITIES | {"language": modality(["task"], [-1, 0])}, "modality language: .* from 0 to 0"),
        (MODALITIES | {"state": modality(["arm", "hand"], [])}, "modality state: its delta_indices must be"),
    ],
    ids=range(7),
)
def test_modalities_that_do_not_suit_are_refused(modalities: object, problem: str) -> None:
    server = Server(get_modality_config=modalities)
    with groot_server(server.answer) as address, pytest.raises(PolicyAnswerError, match=f": {problem}"):
        GrootPolicy(address)


def test_missed_answer_does_not_block_the_next_episode() -> None:
    end = Event()
    waits = [end.wait]
    server = Server(lambda: (waits.pop()() if waits else None) or [{"arm": ARM, "hand": HAND}, {}])
    with policy_at(server) as policy:
        policy.timeout = 0.3
        with pytest.raises(PolicyConnectionError, match=r"no answer within 0.3 s"):
            policy.infer(OBSERVATION)
        end.set()
        policy.timeout = TIMEOUT
        policy.reset(2, "pick")
        assert policy.infer(OBSERVATION).actions.shape == (16, 3)


def test_server_that_is_not_there_is_refused() -> None:
    with pytest.raises(PolicyConnectionError, match=r"cannot be reached \(Connection refused\)"):
        GrootPolicy(f"tcp://127.0.0.1:{free_port()}")


def test_address_that_is_none_is_refused() -> None:
    with pytest.raises(PolicyError, match="no address of a server; write tcp://HOST:PORT"):
        GrootPolicy("tcp://")


@pytest.mark.parametrize(
    ("observation", "problem"),
    [
        ({"prompt": "x"}, "prompt: a key must be video.NAME, state.NAME or language.NAME"),
        ({"video": PICTURE}, "video: a key must be video.NAME"),
        ({"video.a": PICTURE[0]}, r"video.a: it must be a picture \(H, W, 3\) uint8"),
        ({"video.a": PICTURE.astype(float)}, r"video.a: it must be a picture \(H, W, 3\) uint8"),
        ({"state.a": "x"}, r"state.a: it must be numbers \(D,\)"),
        ({"state.a": np.zeros((2, 2))}, r"state.a: it must be numbers \(D,\)"),
        ({"language.a": 1}, "language.a: it must be text"),
    ],
    ids=range(7),
)
def test_observation_of_another_form_is_a_fault_of_the_call(observation: dict[str, object], problem: str) -> None:
    with policy_at(Server()) as policy, pytest.raises(PolicyError, match=f"observation: {problem}"):
        policy.infer(observation)


def test_closed_policy_answers_no_more() -> None:
    with policy_at(Server()) as policy:
        policy.close()
        policy.close()
        with pytest.raises(PolicyConnectionError, match="the policy is closed"):
            policy.infer(OBSERVATION)
