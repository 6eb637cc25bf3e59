"""Policies behind a websocket, against servers on the loopback: their dialects, their errors, and their deaths."""

import hashlib
import re
import socket
import ssl
from collections.abc import Iterator
from contextlib import closing, contextmanager
from threading import Event, Thread
from typing import Any

import msgspec
import numpy as np
import pytest
from websockets.sync.server import ServerConnection

from cellwright.clients.policies import openpi as openpi_module
from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.array_forms import LEBEDOV, MAX_BYTES, OPENPI
from cellwright.clients.policies.codec import pack, unpack
from cellwright.clients.policies.openpi import OpenpiPolicy
from cellwright.clients.policies.policy import Policy, PolicyAnswerError, PolicyConnectionError, PolicyError
from cellwright.clients.policies.sockets import KEY_VARIABLE, TIMEOUT
from tests.support.policy_servers import Infer, openpi, websocket_server
from tests.support.ports import free_port
from tests.support.waiting import wait_until

ROBOARENA: dict[str, object] = {
    "image_resolution": [224, 224],
    "needs_wrist_camera": True,
    "n_external_cameras": 1,
    "needs_stereo_camera": False,
    "needs_session_id": True,
    "action_space": "joint_position",
}
CHUNK = np.array([[0.25, 1.0], [0.5, 0.0]], np.float32)
SHORT = 0.3
"""A deadline under test [s]; servers that outlive it wait for the client."""


def answer(_observation: dict[str, Any]) -> object:
    return {"actions": CHUNK, "server_timing": {"infer_ms": 12.5}, "state": np.zeros(2)}


@contextmanager
def policy_at(infer: Infer = answer, metadata: Any = b"\x80", **options: Any) -> Iterator[OpenpiPolicy]:
    with websocket_server(openpi(infer, metadata)) as address, closing(OpenpiPolicy(address, **options)) as policy:
        yield policy


def test_answer_has_actions_bytes_times_and_the_rest() -> None:
    seen = []

    def infer(observation: dict[str, Any]) -> object:
        seen.append(observation)
        return answer(observation)

    observation = {"observation/state": np.array([0, 1], "<f4"), "prompt": "pick"}
    with policy_at(infer, {"reset_pose": [0.5]}) as policy:
        assert isinstance(policy, Policy)
        assert policy.metadata == {"reset_pose": [0.5]}
        policy.reset(1, "pick")
        found = policy.infer(observation)
    assert found.actions.tolist() == CHUNK.tolist()
    assert found.raw == pack(answer({}), OPENPI)
    assert found.request_sha256 == hashlib.sha256(pack(observation, OPENPI)).hexdigest()
    assert found.infer_ms == 12.5
    assert 0.0 <= found.wall < 240.0
    assert found.extras.keys() == {"server_timing", "state"}
    assert [each["prompt"] for each in seen] == ["pick"]


def test_large_pictures_pass() -> None:
    pictures = {str(number): np.full((480, 640, 3), number, np.uint8) for number in range(4)}
    sums: list[int] = []

    def infer(observation: dict[str, Any]) -> object:
        sums.extend(int(each.sum()) for each in observation.values())
        return {"actions": CHUNK, "seen": observation["3"]}

    with policy_at(infer) as policy:
        assert np.array_equal(np.asarray(policy.infer(pictures).extras["seen"]), pictures["3"])
    assert sums == [480 * 640 * 3 * number for number in range(4)]


def test_server_that_is_not_there_is_refused() -> None:
    with pytest.raises(PolicyConnectionError, match=r"ws://127.0.0.1:\d+: cannot be reached \(Connection refused\)"):
        OpenpiPolicy(f"ws://127.0.0.1:{free_port()}")


@pytest.mark.parametrize("address", ["foo://127.0.0.1:9", "ws://", "ws://127.0.0.1:99999", "ws://a:b"])
def test_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(PolicyError, match="no address of a websocket"):
        OpenpiPolicy(address)


def test_server_without_encryption_or_with_a_refused_certificate_is_not_reached(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with (
        websocket_server(openpi(answer)) as address,
        pytest.raises(PolicyConnectionError, match=r"cannot be reached \(.*SSL"),
    ):
        OpenpiPolicy(address.replace("ws:", "wss:"))

    def refuse(*_: object, **__: object) -> None:
        raise ssl.SSLCertVerificationError(1, "certificate verify failed: self-signed certificate")

    monkeypatch.setattr(openpi_module, "connect", refuse)
    with pytest.raises(PolicyConnectionError, match=r"cannot be reached .certificate verify failed"):
        OpenpiPolicy("wss://127.0.0.1:9")


def test_no_ping_of_ours_ends_a_long_inference() -> None:
    with policy_at() as policy:
        assert policy._connection
        assert policy._connection.keepalive_thread is None


def test_server_that_is_no_websocket_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def talk() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")

        thread = Thread(target=talk)
        thread.start()
        with pytest.raises(PolicyConnectionError, match=r"no websocket answers there .*HTTP 404"):
            OpenpiPolicy(f"ws://127.0.0.1:{server.getsockname()[1]}")
        thread.join()


@pytest.mark.parametrize(
    ("first", "problem"),
    [
        ("Robot policy not available", "the first frame must be metadata .got the text 'Robot policy not available'"),
        (b"\xc1", "the first frame must be a map of metadata .got byte 0"),
        (b"\x91\x01", "the first frame must be a map of metadata .got list"),
        (pack({"type": "error", "message": "no model"}, OPENPI), "the first frame must be a map .* .got no model"),
    ],
    ids=range(4),
)
def test_first_frame_that_is_no_metadata_is_refused(first: bytes | str, problem: str) -> None:
    with websocket_server(openpi(answer, first)) as address, pytest.raises(PolicyAnswerError, match=problem):
        OpenpiPolicy(address)


def test_server_that_never_greets_is_late() -> None:
    end = Event()

    def handle(_connection: ServerConnection) -> None:
        end.wait()

    with websocket_server(handle) as address:
        with pytest.raises(PolicyConnectionError, match=r"no answer within 0.3 s"):
            OpenpiPolicy(address, timeout=SHORT)
        end.set()


def test_error_of_the_policy_is_its_last_line_and_traceback_and_the_next_episode_connects_again() -> None:
    def infer(observation: dict[str, Any]) -> object:
        return {"actions": np.array(observation["state"])}

    with policy_at(infer) as policy:
        with pytest.raises(PolicyAnswerError) as caught:
            policy.infer({})
        first, second, *_ = str(caught.value).splitlines()
        assert first.endswith("the policy failed: KeyError: 'state'")
        assert second == "Traceback (most recent call last):"
        with pytest.raises(PolicyConnectionError, match="the connection is lost; the next episode makes another"):
            policy.infer({"state": np.zeros(2)})
        policy.reset(2, "")
        assert policy.infer({"state": np.zeros(2)}).actions.shape == (1, 2)


def close_after_greeting(connection: ServerConnection) -> None:
    connection.send(b"\x80")
    connection.recv()
    connection.close(1001, "going away")


def vanish_after_greeting(connection: ServerConnection) -> None:
    connection.send(b"\x80")
    connection.recv()
    connection.socket.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize(
    ("handle", "problem"),
    [
        (close_after_greeting, r"the connection is lost \(the server closed it: 1001 going away\)"),
        (vanish_after_greeting, r"the connection is lost \(without a word\)"),
    ],
)
def test_connection_that_ends_without_text_is_lost(handle: Any, problem: str) -> None:
    with websocket_server(handle) as address, closing(OpenpiPolicy(address)) as policy:
        with pytest.raises(PolicyConnectionError, match=problem):
            policy.infer({})
        policy.reset(1, "")  # the next episode has another connection
        with pytest.raises(PolicyConnectionError, match=problem):
            policy.infer({})


def test_late_answer_is_dropped_with_its_connection() -> None:
    end = Event()

    def infer(observation: dict[str, Any]) -> object:
        if observation["number"] == 1:
            end.wait()
        return {"actions": [[float(observation["number"])]]}

    with policy_at(infer) as policy:
        policy.timeout = SHORT
        with pytest.raises(PolicyConnectionError, match=r"no answer within 0.3 s; give it more time"):
            policy.infer({"number": 1})
        policy.timeout = TIMEOUT
        policy.reset(1, "")
        end.set()
        assert policy.infer({"number": 2}).actions.tolist() == [[2.0]]


def test_server_that_does_not_read_is_late() -> None:
    end = Event()

    def handle(connection: ServerConnection) -> None:
        connection.send(b"\x80")
        with connection.protocol_mutex:  # its reader waits for it
            end.wait()

    with websocket_server(handle) as address:
        with closing(OpenpiPolicy(address)) as policy:
            policy.timeout = SHORT
            large = {"picture": np.zeros((40, 1000, 1000), np.uint8)}
            with pytest.raises(PolicyConnectionError, match=r"no answer within 0.3 s"):
                policy.infer(large)
        end.set()


def test_unrequested_frame_ends_the_connection() -> None:
    def handle(connection: ServerConnection) -> None:
        connection.send(b"\x80")
        for _ in connection:
            connection.send(pack(answer({}), OPENPI))
            connection.send(pack(answer({}), OPENPI))

    with websocket_server(handle) as address, closing(OpenpiPolicy(address)) as policy:
        policy.infer({})
        wait_until(lambda: policy._connection and policy._connection.recv_messages.frames.qsize(), "second frame")
        with pytest.raises(PolicyAnswerError, match="a frame that no request asked for"):
            policy.infer({})


def test_answer_beyond_the_limit_is_refused() -> None:
    problem = "a message of it is larger than 64 MiB"
    with policy_at(lambda _: bytes(MAX_BYTES + 1)) as policy, pytest.raises(PolicyConnectionError, match=problem):
        policy.infer({})


@pytest.mark.parametrize(
    ("reply", "problem"),
    [
        (b"\xc1", "byte 0: no value of this wire"),
        (
            msgspec.msgpack.encode(
                {"actions": {b"__ndarray__": True, b"data": bytes(8), b"dtype": "|O", b"shape": [1]}}
            ),
            "actions: an array's type must be bool, integer or float",
        ),
        ({"state": 1}, "the reply: it must have actions .got the keys state"),
        ({"actions": np.full((2, 2), np.nan)}, "actions: action 0, number 0 must be finite"),
        ({"actions": np.zeros((2, 3))}, "actions: an action must have 2 numbers .got 3"),
        ({"type": "error", "message": "no\nmodel"}, r"the policy failed: no\\nmodel"),
    ],
    ids=range(6),
)
def test_answer_that_is_no_chunk_names_the_server(reply: object, problem: str) -> None:
    with policy_at(lambda _: reply, actions=ActionFormat(2)) as policy, pytest.raises(PolicyAnswerError) as caught:
        policy.infer({})
    assert re.match(rf"ws://127.0.0.1:\d+: {problem}", str(caught.value))


def test_observation_that_cannot_be_sent_is_a_fault_of_the_call() -> None:
    with policy_at() as policy:
        with pytest.raises(PolicyError, match="observation: a/b: a value of this type cannot be sent"):
            policy.infer({"a": {"b": object()}})
        assert policy.infer({}).actions.tolist() == CHUNK.tolist()  # the connection is as it was


def test_key_of_the_environment_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def handle(connection: ServerConnection) -> None:
        assert connection.request is not None
        seen.append(connection.request.headers.get("Authorization"))
        connection.send(b"\x80")

    with websocket_server(handle) as address:
        OpenpiPolicy(address).close()
        monkeypatch.setenv(KEY_VARIABLE, " k1\n")
        OpenpiPolicy(address).close()
        monkeypatch.setenv(KEY_VARIABLE, "k1\r\nX: 1")
        with pytest.raises(PolicyError, match=f"{KEY_VARIABLE}: the key must be printable ASCII"):
            OpenpiPolicy(address)
    assert seen == [None, "Api-Key k1"]


@pytest.mark.parametrize("confirmation", ["reset successful", {"status": "reset successful"}], ids=["text", "map"])
@pytest.mark.parametrize("vllm", [False, True])
def test_resets_and_sessions_of_roboarena_and_vllm(confirmation: object, vllm: bool) -> None:
    seen: list[dict[str, Any]] = []

    def infer(request: dict[str, Any]) -> object:
        seen.append(request)
        return confirmation if request["endpoint"] == "reset" else {"actions": CHUNK[np.newaxis]}

    metadata = ROBOARENA | ({"action_dim": 2} if vllm else {})
    with policy_at(infer, metadata) as policy:
        assert policy.dialect.name == ("vllm" if vllm else "roboarena")
        for seed in (7, 8):
            policy.reset(seed, "pick")
            digest = policy.infer({"prompt": "pick"}).request_sha256
            assert digest == hashlib.sha256(pack({"prompt": "pick"}, OPENPI)).hexdigest()
    assert [each["endpoint"] for each in seen] == ["reset", "infer"] * 2
    assert seen[0]["session_id"] == seen[1]["session_id"] != seen[2]["session_id"] == seen[3]["session_id"]
    assert [each.get("seed") for each in seen] == ([None, 7, None, 8] if vllm else [None] * 4)


def test_reset_that_is_refused_says_why() -> None:
    refusal, problem = {"type": "error", "message": "no model"}, r"the reset was not confirmed \(got 'no model'\)"
    with policy_at(lambda _: refusal, ROBOARENA) as policy, pytest.raises(PolicyAnswerError, match=problem):
        policy.reset(1, "")


def test_reset_after_an_idle_close_connects_again() -> None:
    connections = []

    def handle(connection: ServerConnection) -> None:
        connections.append(connection)
        connection.send(pack(ROBOARENA, OPENPI))
        for frame in connection:
            request = unpack(bytes(frame), OPENPI)  # type: ignore[arg-type]
            assert isinstance(request, dict)
            connection.send("reset successful" if request["endpoint"] == "reset" else pack(answer({}), OPENPI))

    with websocket_server(handle) as address, closing(OpenpiPolicy(address)) as policy:
        policy.reset(1, "")
        policy.infer({})
        connections[0].close(1000, "idle")
        with pytest.raises(PolicyConnectionError, match="the server closed it: 1000 idle"):
            policy.infer({})  # never within an episode
        policy.reset(2, "")
        connections[1].close(1000, "idle")
        policy.reset(3, "")  # the loss shows when the reset is sent
        assert policy.infer({}).actions.tolist() == CHUNK.tolist()
    assert len(connections) == 3


@pytest.mark.parametrize("bare", [False, True])
def test_vllm_may_answer_by_action_key_or_with_a_bare_array(bare: bool) -> None:
    parts = {"gripper_position": CHUNK[np.newaxis, :, 1:], "joint_position": CHUNK[np.newaxis, :, :1]}
    reply = CHUNK[np.newaxis] if bare else parts
    with policy_at(lambda _: reply, ROBOARENA | {"action_keys": ["joint_position", "gripper_position"]}) as policy:
        assert policy.infer({}).actions.tolist() == CHUNK.tolist()


@pytest.mark.parametrize("metadata", [{"model_name": "x"}, {"mean": np.zeros(2)}, {}], ids=["name", "array", "set"])
def test_arrays_of_lebedov_are_spoken(metadata: dict[str, object]) -> None:
    def infer(observation: dict[str, Any]) -> object:
        return {"actions": observation["state"][np.newaxis]}

    dialect = None if metadata else "lebedov"
    with (
        websocket_server(openpi(infer, metadata, LEBEDOV)) as address,
        closing(OpenpiPolicy(address, dialect=dialect)) as policy,
    ):
        assert policy.dialect.name == "lebedov"
        assert policy.infer({"state": np.array([0.5, 1.0])}).actions.tolist() == [[0.5, 1.0]]


def test_wrong_dialect_says_which_it_is() -> None:
    with (
        websocket_server(openpi(lambda _: {"actions": CHUNK}, {}, LEBEDOV)) as address,
        closing(OpenpiPolicy(address)) as policy,
        pytest.raises(PolicyAnswerError, match="form of lebedov"),
    ):
        policy.infer({})


def test_second_close_does_nothing() -> None:
    with policy_at() as policy:
        policy.close()
        policy.close()
        with pytest.raises(PolicyConnectionError, match="the connection is lost"):
            policy.infer({})
