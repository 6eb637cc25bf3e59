"""Policies of this process: functions and classes."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.callable_policy import CallablePolicy, policy_of_class
from cellwright.clients.policies.codec import pack
from cellwright.clients.policies.policy import Policy, PolicyAnswerError, PolicyError
from cellwright.util.errors import RunEndedError

SOURCE = """
import numpy as np
class Counting:
    metadata = {"name": "counting"}
    def __init__(self): self.count = 0.0
    def reset(self, seed, sentence): self.count = float(seed + len(sentence))
    def infer(self, observation):
        self.count += 1.0
        return {"actions": np.full((3, 2), self.count), "policy_timing": {"infer_ms": 2.0}}
    def close(self): 1 / 0
class Broken:
    def __init__(self): raise ValueError("no weights")
    def infer(self, observation): pass
class Other: pass
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "counting.py"
    path.write_text(SOURCE)
    return path


def test_class_of_a_file_is_a_policy(file: Path) -> None:
    policy = policy_of_class(f"{file}:Counting", ActionFormat(2))
    assert isinstance(policy, Policy)
    assert policy.metadata == {"name": "counting"}
    policy.reset(3, "go")
    observation = {"state": np.zeros(2)}
    answer = policy.infer(observation)
    assert answer.actions.tolist() == [[6.0, 6.0]] * 3
    assert answer.raw == pack({"actions": answer.actions}, OPENPI)
    assert answer.request_sha256 == hashlib.sha256(pack(observation, OPENPI)).hexdigest()
    assert answer.infer_ms == 2.0
    with pytest.raises(PolicyAnswerError, match=r"counting.py:Counting: failed in close: ZeroDivisionError"):
        policy.close()
    policy.close()


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("Broken", "cannot be made: ValueError: no weights"),
        ("Other", r"a policy is a class with a method infer\(observation\)"),
        ("Countin", "unknown class 'Countin'; did you mean Counting"),
    ],
)
def test_class_that_is_no_policy_is_refused(file: Path, name: str, problem: str) -> None:
    with pytest.raises(PolicyError, match=problem):
        policy_of_class(f"{file}:{name}", ActionFormat())


def test_error_of_the_function_is_no_verdict() -> None:
    def broken(_: object) -> object:
        raise SystemExit(3)

    with pytest.raises(PolicyAnswerError, match="mine: failed in broken: SystemExit: 3"):
        CallablePolicy(broken, name="mine").infer({})
    with pytest.raises(PolicyAnswerError, match="mine: actions: an action must have 2 numbers"):
        CallablePolicy(lambda _: [1.0], name="mine", actions=ActionFormat(2)).infer({})


def test_end_of_the_run_passes() -> None:
    def ended(_: object) -> object:
        raise RunEndedError

    with pytest.raises(RunEndedError):
        CallablePolicy(ended).infer({})


def test_observation_that_no_server_could_read_is_refused_here_too() -> None:
    with pytest.raises(PolicyError, match="observation: a: a value of this type cannot be sent"):
        CallablePolicy(lambda _: [1.0]).infer({"a": object()})
