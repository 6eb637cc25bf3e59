"""Policies by their addresses."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from cellwright import load_trial
from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.connect import connect
from cellwright.clients.policies.policy import PolicyAnswerError, PolicyError
from cellwright.config.control import ControlSpace
from tests.support.policy_servers import openpi, websocket_server


def test_websocket_is_connected_in_the_given_dialect() -> None:
    seen = []

    def infer(request: dict[str, object]) -> object:
        seen.append(request)
        return [[1.0, 2.0]]

    with websocket_server(openpi(infer)) as address:
        with closing(connect(address + "/v1/path", dialect="vllm", actions=ActionFormat(2))) as policy:
            assert policy.infer({"a": 1}).actions.tolist() == [[1.0, 2.0]]
        with closing(connect(address, actions=ActionFormat(3))) as policy, pytest.raises(PolicyAnswerError):
            policy.infer({})
    assert seen[0]["endpoint"] == "infer"
    assert seen[0]["a"] == 1


def test_bundled_policies_are_named() -> None:
    space = ControlSpace.of(load_trial("lesson"))
    state = np.array([0.0, -1.5, 0, 0, 0, 0, 0, 0])
    with closing(connect("hold", space=space)) as policy:
        policy.reset(1, "")
        assert policy.infer({"state": state}).actions.tolist() == [state.tolist()]
    with pytest.raises(PolicyError, match="hold: this policy needs the channels of a cell"):
        connect("hold")


def test_class_of_a_file_is_made(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text("class Mine:\n    def infer(self, observation):\n        return [[0.5]]\n")
    with closing(connect(f"{path}:Mine")) as policy:
        assert policy.infer({}).actions.tolist() == [[0.5]]


@pytest.mark.parametrize(
    ("address", "options", "problem"),
    [
        ("hodl", {}, "unknown policy 'hodl'; did you mean hold; a policy is ws://HOST:PORT"),
        ("", {}, "unknown policy ''; a policy is"),
        ("localhost:8000", {}, "an address begins with its scheme; write ws://localhost:8000"),
        ("ftp://localhost", {}, "no scheme of a policy server"),
        ("none.py:Mine", {}, "none.py: there is no such file"),
        ("hold", {"dialect": "openpi"}, "dialect: only a server has one"),
        ("ws://localhost:1", {"dialect": "opnpi"}, "dialect: unknown 'opnpi'; did you mean openpi"),
        ("ws://localhost:1", {"timeout": 0.0}, "timeout: must be above 0 s"),
    ],
)
def test_what_is_no_policy_is_refused(address: str, options: dict[str, object], problem: str) -> None:
    with pytest.raises(PolicyError) as caught:
        connect(address, **options)  # type: ignore[arg-type]
    assert problem in str(caught.value)
