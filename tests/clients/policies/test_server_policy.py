"""The common part of policies behind servers: settings, and the way from an observation to an answer."""

import hashlib
from collections.abc import Mapping

import numpy as np
import pytest

from cellwright.clients.policies.act import ActPolicy
from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.groot import GrootPolicy
from cellwright.clients.policies.openpi import OpenpiPolicy
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyError
from cellwright.clients.policies.server_policy import ServerPolicy
from cellwright.clients.policies.sockets import TIMEOUT
from cellwright.util.errors import MessageError


class Echo(ServerPolicy):
    """A wire without a server: the reply to a request is the request."""

    wire, dialects = "echo", ("plain",)

    def reset(self, seed: int, sentence: str) -> None:
        """Begin an episode: nothing is kept of it."""

    def close(self) -> None:
        """Do nothing."""

    def _request(self, observation: Mapping[str, object]) -> tuple[bytes, bytes]:
        if "prompt" not in observation:
            raise MessageError("no prompt")
        return b"observation", b"request"

    def _exchange(self, request: bytes) -> tuple[bytes, float]:
        return request, 0.25

    def _reply(self, raw: bytes) -> tuple[object, object, Mapping[str, object]]:
        return np.zeros((3, 2)), {"server_timing": {"infer_ms": 40.0}}, {"raw": raw}


@pytest.mark.parametrize(
    ("wire", "dialect", "problem"),
    [
        (ActPolicy, "act-encode", r"did you mean act-encoded \(known for HTTP: act, act-encoded\)"),
        (GrootPolicy, "openpi", r" \(known for tcp: groot, groot-sim\)"),
        (OpenpiPolicy, "robo_arena", r"did you mean roboarena \(known for a websocket: openpi, lebedov, .*\)"),
    ],
)
def test_dialect_that_a_wire_lacks_is_refused(wire: type[ServerPolicy], dialect: str, problem: str) -> None:
    with pytest.raises(PolicyError, match=f"dialect: unknown '{dialect}'.*{problem}"):
        wire("ws://127.0.0.1:9", dialect=dialect)


def test_answer_has_the_digest_of_the_observation_and_the_times_of_wire_and_server() -> None:
    policy = Echo("echo://lab")
    found = policy.infer({"prompt": "pick"})
    assert (policy.timeout, policy.metadata) == (TIMEOUT, {})
    assert (found.raw, found.wall, found.infer_ms, found.extras) == (b"request", 0.25, 40.0, {"raw": b"request"})
    assert found.request_sha256 == hashlib.sha256(b"observation").hexdigest()


def test_errors_of_the_call_name_the_observation_and_those_of_the_answer_the_server() -> None:
    policy = Echo("echo://lab", actions=ActionFormat(dimension=7))
    with pytest.raises(PolicyError, match=r"^observation: no prompt$"):
        policy.infer({})
    with pytest.raises(PolicyAnswerError, match=r"^echo://lab: actions: an action must have 7 numbers \(got 2\)$"):
        policy.infer({"prompt": "pick"})
