"""Policies behind `POST /act`, against a server on the loopback."""

import hashlib
import socket
from collections.abc import Iterator
from contextlib import closing, contextmanager
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from cellwright.clients.policies.act import ActPolicy
from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.codec import pack_json
from cellwright.clients.policies.policy import Policy, PolicyAnswerError, PolicyConnectionError, PolicyError
from tests.support.policy_servers import act_server
from tests.support.ports import free_port

ACTION = np.array([0.5, -1.0, 2.0], np.float32)
OBSERVATION = {"image": np.zeros((4, 6, 3), np.uint8), "instruction": "pick"}
HEAD = b"HTTP/1.1 200 OK\r\n"


@pytest.mark.parametrize("dialect", [None, "act", "act-encoded"])
@pytest.mark.parametrize(
    "reply", [ACTION, ACTION.tolist(), {"actions": ACTION[np.newaxis]}], ids=["numpy", "list", "map"]
)
def test_action_comes_in_any_form(dialect: str | None, reply: object) -> None:
    seen = []

    def act(observation: dict[str, Any]) -> object:
        seen.append(observation)
        return reply

    with act_server(act) as address, closing(ActPolicy(address + "/act", dialect=dialect)) as policy:
        assert isinstance(policy, Policy)
        assert policy.metadata == {}
        policy.reset(1, "pick")
        answer = policy.infer(OBSERVATION)
        policy.infer(OBSERVATION)
    assert answer.actions.tolist() == [ACTION.tolist()]
    assert answer.request_sha256 == hashlib.sha256(pack_json(OBSERVATION)).hexdigest()
    assert [each["instruction"] for each in seen] == ["pick", "pick"]
    assert seen[0]["image"].shape == (4, 6, 3)


@pytest.mark.parametrize("dialect", ["act", "act-encoded"])
def test_error_of_status_200_is_an_error(dialect: str) -> None:
    def act(_: object) -> object:
        raise ValueError

    problem = "the policy failed: error; see the server's log"
    with (
        act_server(act) as address,
        closing(ActPolicy(address, dialect=dialect)) as policy,
        pytest.raises(PolicyAnswerError, match=problem),
    ):
        policy.infer(OBSERVATION)


@pytest.mark.parametrize(
    ("reply", "problem"),
    [
        (b"{", "not JSON"),
        (b"[NaN, 1, 2]", "actions: action 0, number 0 must be finite"),
        (b"[1, 2]", "actions: an action must have 3 numbers"),
        (b'{"__numpy__": "AAAA", "dtype": "|O", "shape": [1]}', "the message: an array's type must be bool"),
        (b"{}", "the reply: it must have actions"),
        (b" " * (2**24 + 1), "an answer has at most 16 MiB"),
    ],
    ids=range(6),
)
def test_answer_that_is_no_action_names_the_server(reply: bytes, problem: str) -> None:
    with (
        act_server(lambda _: reply) as address,
        closing(ActPolicy(address, actions=ActionFormat(3))) as policy,
        pytest.raises(PolicyAnswerError) as caught,
    ):
        policy.infer(OBSERVATION)
    assert str(caught.value).startswith(f"{address}: {problem}")


def test_status_other_than_200_is_an_error() -> None:
    with (
        act_server(lambda _: ACTION) as address,
        closing(ActPolicy(f"{address}/predict")) as policy,
        pytest.raises(PolicyAnswerError, match=r"HTTP 404 Not Found: \{"),
    ):
        policy.infer(OBSERVATION)


def test_server_that_is_not_there_is_refused() -> None:
    with pytest.raises(PolicyConnectionError, match=r"cannot be reached \(Connection refused\)"):
        ActPolicy(f"http://127.0.0.1:{free_port()}/act")


@contextmanager
def raw_server(reply: bytes, end: Event | None = None) -> Iterator[str]:
    """Answer each connection with bytes; with an event the connection stays open until it is set."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def talk() -> None:
            server.accept()[0].close()  # the check that a server listens
            connection, _ = server.accept()
            with connection:
                connection.recv(65536)
                connection.sendall(reply)
                if end:
                    end.wait()

        thread = Thread(target=talk)
        thread.start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}"
        thread.join()


@pytest.mark.parametrize("reply", [b"", b"HTTP", b"what\r\n\r\n", HEAD + b"Content-Length: 9\r\n\r\n[1"], ids=range(4))
def test_connection_that_breaks_is_lost(reply: bytes) -> None:
    with (
        raw_server(reply) as address,
        closing(ActPolicy(address)) as policy,
        pytest.raises(PolicyConnectionError, match="the request failed"),
    ):
        policy.infer({})


@pytest.mark.parametrize("reply", [b"", HEAD, HEAD + b"\r\n[1"], ids=["nothing", "head", "half a body"])
def test_late_answer_is_refused(reply: bytes) -> None:
    end = Event()
    with raw_server(reply, end) as address, closing(ActPolicy(address)) as policy:
        policy.timeout = 0.3
        with pytest.raises(PolicyConnectionError, match=r"no answer within 0.3 s"):
            policy.infer({})
        end.set()


@pytest.mark.parametrize("address", ["http://", "http:///act", "http://a:b", "http://a:99999"])
def test_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(PolicyError, match="no address of a server; write http://HOST:PORT"):
        ActPolicy(address)


def test_observation_that_cannot_be_sent_is_a_fault_of_the_call() -> None:
    problem = "observation: a: a value of this type cannot be sent"
    with (
        act_server(lambda _: ACTION) as address,
        closing(ActPolicy(address)) as policy,
        pytest.raises(PolicyError, match=problem),
    ):
        policy.infer({"a": object()})
