"""Requests to a served environment: what is taken, and what is refused with its key."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import pack
from cellwright.envs.served.protocol import Close, Hello, Render, Reset, Step, read_request
from cellwright.util.errors import MessageError


def read(**fields: Any) -> Any:
    return read_request(pack(fields, OPENPI))


def test_requests_are_read_as_they_were_sent() -> None:
    assert read(type="hello") == Hello()
    assert read(type="hello", task="push_to_goal") == Hello("push_to_goal")
    assert read(type="render") == Render()
    assert read(type="close") == Close()
    options = {"variation": False, "joints": {"elbow_joint": 1}, "lerobot_new_rollout": True, "other": None}
    expected = Reset(2**63 - 1, {"variation": False, "joints": {"elbow_joint": 1.0}})
    assert read(type="reset", seed=2**63 - 1, options=options) == expected
    assert read(type="reset", seed=np.int64(3), options=None) == Reset(3)


@pytest.mark.parametrize(
    ("action", "is_chunk"),
    [([1, 2.5], False), (np.array([1, 2.5], np.float32), False), ([[1, 2], [3, 4]], True), (np.ones((1, 2)), True)],
)
def test_actions_are_rows_of_numbers(action: Any, is_chunk: bool) -> None:
    step = read(type="step", action=action)
    assert isinstance(step, Step)
    assert step.is_chunk is is_chunk
    assert step.actions.dtype == np.float64
    assert np.array_equal(step.actions, np.atleast_2d(np.asarray(action)))


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({}, "type: must be hello, reset, step, render, close (got None)"),
        ({"type": "stop"}, "type: must be hello, reset, step, render, close (got 'stop')"),
        ({"type": "render", "size": 3}, "render: unknown key 'size' (known: none)"),
        ({"type": "reset", "sed": 3}, "reset: unknown key 'sed'; did you mean seed"),
        ({"type": "hello", "task": 3}, "hello: task: must be a name (got 3)"),
        ({"type": "reset", "seed": -1}, "reset: seed: must be a whole number from 0 to 2**63 - 1 (got -1)"),
        ({"type": "reset", "seed": True}, "reset: seed: must be a whole number from 0 to 2**63 - 1 (got True)"),
        ({"type": "reset", "seed": 1.0}, "reset: seed: must be a whole number from 0 to 2**63 - 1 (got 1.0)"),
        ({"type": "reset", "options": [1]}, "reset: options: must be a map (got [1])"),
        (
            {"type": "reset", "options": {"variation": "no"}},
            "reset: options/variation: must be true or false (got 'no')",
        ),
        ({"type": "reset", "options": {"joints": {"elbow": np.nan}}}, "reset: options/joints: must be a map of names"),
        ({"type": "reset", "options": {"joints": {"elbow": "up"}}}, "reset: options/joints: must be a map of names"),
        ({"type": "reset", "options": {"snapshot": 1}}, "reset: options/snapshot: cannot be sent; repeat the episode"),
        ({"type": "step"}, "step: action: must be numbers, D or a chunk of H x D (got None)"),
        ({"type": "step", "action": []}, "step: action: must be numbers"),
        ({"type": "step", "action": ["1"]}, "step: action: must be numbers"),
        ({"type": "step", "action": [True]}, "step: action: must be numbers"),
        ({"type": "step", "action": [[1, 2], [3]]}, "step: action: must be numbers"),
        ({"type": "step", "action": np.ones((1, 1, 1))}, "step: action: must be numbers"),
        ({"type": "step", "action": np.ones((0, 2))}, "step: action: must be numbers"),
        ({"type": "step", "action": [1.0, np.inf]}, "step: action: a number must be finite (got one that is not)"),
    ],
)
def test_a_wrong_request_is_refused_with_its_key(fields: dict[str, Any], error: str) -> None:
    with pytest.raises(MessageError) as raised:
        read(**fields)
    assert str(raised.value).startswith(error)


def test_frames_that_are_no_map_are_refused() -> None:
    with pytest.raises(MessageError, match=r"a binary frame of MessagePack \(got text\)"):
        read_request("hello")
    with pytest.raises(MessageError, match=r"a request must be a map \(got list\)"):
        read_request(b"\x90")
    with pytest.raises(MessageError, match="action: an array's type must be bool, integer or float"):
        read_request(
            bytes.fromhex("82a474797065a473746570a6616374696f6e84c40b5f5f6e6461727261795f5fc3c40464617461c40800000000")
            + bytes.fromhex("00000000c4056474797065a27c4fc40573686170659101")
        )


_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=5)
    | st.binary(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
_KINDS = st.sampled_from(["hello", "reset", "step", "render", "close"])
_NAMES = st.sampled_from(["task", "seed", "options", "action"])


@given(st.binary(max_size=60))
def test_hostile_bytes_are_refused(frame: bytes) -> None:
    with pytest.raises(MessageError):
        read_request(frame)


@given(_KINDS, st.dictionaries(_NAMES, _VALUES, max_size=2))
def test_hostile_values_are_read_or_refused(kind: str, fields: dict[str, Any]) -> None:
    try:
        request = read(type=kind, **fields)
    except MessageError:
        return
    assert type(request).__name__.lower() == kind
