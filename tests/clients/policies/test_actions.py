"""Chunks of actions: every shape that servers give, and what is none."""

import numpy as np
import pytest

from cellwright.clients.policies.actions import ActionFormat, extras, server_time
from cellwright.clients.policies.policy import PolicyAnswerError

CHUNK = [[0.5, 1.0], [0.25, 0.0]]
PARTS = ActionFormat(2, ("arm", "gripper"))


@pytest.mark.parametrize(
    "reply",
    [
        CHUNK,
        np.array(CHUNK),
        np.array(CHUNK, "<f4"),
        np.array(CHUNK, ">f4"),
        np.array([CHUNK]),
        {"actions": CHUNK},
        {"action": np.array(CHUNK)},
        {"actions": np.array([CHUNK], np.float32), "state": 1},
    ],
    ids=range(8),
)
def test_every_shape_of_a_reply_is_the_same_chunk(reply: object) -> None:
    for dimension in (None, 2):
        actions = ActionFormat(dimension).read(reply)
        assert actions.dtype == np.float64
        assert actions.tolist() == CHUNK


def test_one_action_is_a_chunk_of_one() -> None:
    assert ActionFormat(2).read({"actions": np.array([0.5, 1.0])}).tolist() == [[0.5, 1.0]]
    assert ActionFormat(2).read({"actions": np.array([[0.5, 1.0]])}).tolist() == [[0.5, 1.0]]


@pytest.mark.parametrize("wrap", [lambda parts: parts, lambda parts: {"actions": parts}], ids=["bare", "as actions"])
@pytest.mark.parametrize("batch", [False, True])
def test_parts_are_joined_in_the_order_of_their_keys(wrap: type, batch: bool) -> None:
    parts = {"gripper": np.array([[1.0], [0.0]]), "arm": np.array([[0.5], [0.25]]), "more": 1}
    if batch:
        parts = {key: np.asarray(each)[np.newaxis] for key, each in parts.items()}
    assert PARTS.read(wrap(parts)).tolist() == CHUNK


@pytest.mark.parametrize(
    ("reply", "problem"),
    [
        ({"state": 1}, "the reply: it must have actions (got the keys state)"),
        ({}, "the reply: it must have actions (got the keys none)"),
        ({"actions": {"a": 1}}, "actions: it must have actions (got the keys a)"),
        ({"error": "no\nmodel"}, r"the policy reports: no\nmodel"),
        ({"message": "no model"}, "the policy reports: no model"),
        ("text", "actions: it must be an array of numbers (got str)"),
        (None, "actions: it must be an array of numbers (got NoneType)"),
        ({"actions": ["1.5"]}, "actions: it must be an array of floats (got <U3)"),
        ({"actions": [True]}, "actions: it must be an array of floats (got bool)"),
        ({"actions": [2**80]}, "actions: it must be an array of floats (got object)"),
        ({"actions": [[1.0], [1.0, 2.0]]}, "actions: it must be a list of equally many numbers each"),
        ({"actions": np.zeros((2, 2, 2))}, "actions: its shape must be (H, D), (D,) or (1, H, D) (got (2, 2, 2))"),
        ({"actions": np.zeros(())}, "actions: its shape must be"),
        ({"actions": np.zeros((0, 2))}, "actions: it must have at least one action (got shape (0, 2))"),
        ({"actions": []}, "actions: it must have at least one action"),
        ({"actions": np.zeros((1, 0, 2))}, "actions: it must have at least one action"),
        ({"actions": np.zeros((5, 3))}, "actions: an action must have 2 numbers (got 3)"),
        ({"actions": np.zeros(5)}, "actions: an action must have 2 numbers (got 5)"),
        ({"actions": [[0, 0], [0, np.nan]]}, "actions: action 1, number 1 must be finite (got nan)"),
        ({"actions": [[-np.inf, 0]]}, "actions: action 0, number 0 must be finite (got -inf)"),
    ],
    ids=range(20),
)
def test_what_is_no_chunk_is_refused(reply: object, problem: str) -> None:
    with pytest.raises(PolicyAnswerError) as caught:
        ActionFormat(2).read(reply)
    assert str(caught.value).startswith(problem)


@pytest.mark.parametrize(
    ("reply", "problem"),
    [
        ({"arm": [1.0]}, "the reply: it must have gripper of its action keys (got the keys arm)"),
        ({"arm": np.zeros((2, 1)), "gripper": np.zeros((3, 1))}, "actions: all parts must have equally many actions"),
        ({"arm": np.zeros((2, 1)), "gripper": [[np.nan]]}, "actions/gripper: action 0, number 0 must be finite"),
        ({"arm": np.zeros((2, 1)), "gripper": np.zeros((2, 2))}, "actions: an action must have 2 numbers (got 3)"),
        ({"arm": np.zeros((2, 1, 1)), "gripper": [[1.0]]}, "actions/arm: its shape must be (H, D)"),
    ],
    ids=range(5),
)
def test_parts_that_are_no_chunk_are_refused(reply: object, problem: str) -> None:
    with pytest.raises(PolicyAnswerError) as caught:
        PARTS.read(reply)
    assert str(caught.value).startswith(problem)


def test_time_of_the_server_is_its_own_before_the_policys() -> None:
    assert server_time({"server_timing": {"infer_ms": 12.5}, "policy_timing": {"infer_ms": 9}}) == 12.5
    assert server_time({"policy_timing": {"infer_ms": 9}}) == 9.0
    for reply in (
        1,
        {},
        {"server_timing": 3},
        {"server_timing": {"infer_ms": "9"}},
        {"server_timing": {"infer_ms": -1}},
    ):
        assert server_time(reply) is None
    assert server_time({"server_timing": {"infer_ms": float("nan")}}) is None


def test_extras_are_what_is_not_actions() -> None:
    assert extras({"actions": 1, "state": 2}) == {"state": 2}
    assert extras([1]) == {}
