"""Bytes of policy servers: those of the reference packages, round trips, and hostile input."""

import json
import random
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from cellwright.clients.policies.array_forms import LEBEDOV, MAX_BYTES, NPY, OPENPI, ArrayForm
from cellwright.clients.policies.codec import MAX_VALUES, pack, pack_json, unpack, unpack_json
from cellwright.util.errors import MessageError
from tests.conftest import load_cases

CASES = load_cases("policy_wire_cases.json")
FORMS = {form.name: form for form in (OPENPI, LEBEDOV, NPY)}

arrays = hnp.arrays(
    st.sampled_from(["|b1", "|u1", "|i1", "<i4", ">i2", "<u8", "<f4", ">f4", "<f8", "<f2"]),
    hnp.array_shapes(min_dims=0, max_dims=5, min_side=0, max_side=3),
)
plain = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=8)
)
names = st.text(max_size=8).filter(lambda name: not name.startswith("__"))
values = st.recursive(
    plain | arrays, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(names, inner, max_size=3), max_leaves=8
)


def value_of(described: Any) -> Any:
    """Return the value that a case describes."""
    if isinstance(described, dict) and "array" in described:
        return np.array(described["array"], described["dtype"]).reshape(described["shape"])
    if isinstance(described, dict) and "scalar" in described:
        return np.dtype(described["dtype"]).type(described["scalar"])
    if isinstance(described, dict):
        return {key: value_of(each) for key, each in described.items()}
    return described


def same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, with types, shapes and bytes of arrays."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, (np.ndarray, np.generic)) or isinstance(other, (np.ndarray, np.generic)):
        return type(one) is type(other) and one == other
    if isinstance(one, dict):
        return isinstance(other, dict) and one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return isinstance(other, list) and len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_bytes_are_those_of_the_reference(case: dict[str, Any]) -> None:
    value, content = value_of(case["value"]), bytes.fromhex(case["bytes"])
    if case["form"] == "json_numpy":
        assert json.loads(pack_json(value)) == json.loads(content)
        assert same(unpack_json(content), value)
    else:
        form = FORMS[case["form"]]
        assert pack(value, form).hex() == case["bytes"]
        assert same(unpack(content, form), value)


@given(values, st.sampled_from([OPENPI, LEBEDOV, NPY]))
def test_values_survive_messagepack(value: object, form: ArrayForm) -> None:
    assert same(unpack(pack(value, form), form), value)


@given(values.filter(lambda value: not has_scalar_array(value)))
def test_values_survive_json(value: object) -> None:
    assert same(unpack_json(pack_json(value)), value)


def has_scalar_array(value: object) -> bool:
    """Return whether there is an array without axes: json_numpy reads it as a scalar."""
    if isinstance(value, dict):
        return any(map(has_scalar_array, value.values()))
    return any(map(has_scalar_array, value)) if isinstance(value, list) else getattr(value, "shape", None) == ()


def test_array_in_columns_is_sent_in_rows() -> None:
    columns = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    for form in (OPENPI, LEBEDOV, NPY):
        assert np.array_equal(unpack(pack({"a": columns[:, ::2]}, form), form)["a"], columns[:, ::2])  # type: ignore[index]


def test_decoded_array_is_read_only() -> None:
    array = unpack(pack(np.zeros(2), OPENPI), OPENPI)
    assert isinstance(array, np.ndarray)
    assert not array.flags.writeable


def test_keys_of_bytes_become_text() -> None:
    assert unpack(msgspec.msgpack.encode({b"actions": [1]}), OPENPI) == {"actions": [1]}


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ({"a": {"b": np.array([object()])}}, "a/b: only arrays of bool, integers and floats can be sent (got object)"),
        ({"a": np.zeros(1, complex)}, "a: only arrays of bool, integers and floats can be sent (got complex128)"),
        ({"a": [np.zeros(1, "M8[s]")]}, r"a[0]: only arrays of bool, integers and floats can be sent"),
        ({"a": np.datetime64(1, "s")}, "a: only arrays of bool, integers and floats can be sent"),
        ({"a": np.zeros((1,) * 6)}, "a: an array has at most 5 axes (got 6)"),
        ({"a": {1: 2}}, "a: a key must be text (got '1')"),
        ({"a": {1, 2}}, "a: a value of this type cannot be sent (got set)"),
        ({"a": 2**64}, "a message cannot be packed"),
    ],
)
def test_value_that_cannot_be_sent_names_its_key(value: object, problem: str) -> None:
    for form in (OPENPI, LEBEDOV, NPY):
        with pytest.raises(MessageError) as caught:
            pack(value, form)
        assert str(caught.value).startswith(problem)


def test_json_has_no_bytes_and_nothing_infinite() -> None:
    for value in (b"x", float("inf"), [float("nan")]):
        with pytest.raises(MessageError, match="cannot be written as JSON"):
            pack_json({"a": value})


def test_array_of_another_dialect_says_which() -> None:
    with pytest.raises(MessageError, match=r"^a: an array in the form of lebedov \(expected openpi\); set the dialect"):
        unpack(pack({"a": np.zeros(1)}, LEBEDOV), OPENPI)
    with pytest.raises(MessageError, match=r"^a: an array in the form of openpi \(expected lebedov\)"):
        unpack(pack({"a": np.zeros(1)}, OPENPI), LEBEDOV)
    with pytest.raises(MessageError, match=r"^a\[1\]: an array whose marks are text"):
        unpack(msgspec.msgpack.encode({"a": [0, {"__ndarray__": True}]}), OPENPI)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "not MessagePack"),
        (b"\xc1", "byte 0: no value of this wire"),
        (b"\xd4\x01\x00", "byte 0: no value of this wire"),  # an extension type
        (b"\x81\xa1a", "not MessagePack"),  # cut off
        (b"\x80\x80", "not MessagePack"),  # two messages
        (b"\x81\xa1\xff\x01", "not MessagePack"),  # a key that is no UTF-8
        (b"\x81\x90\x01", "the message: a key must be text (got '()')"),  # a list as a key
        (b"\x81\x01\x02", "the message: a key must be text (got '1')"),
        (b"\xdd\xff\xff\xff\xff", "not MessagePack"),  # four billion values announced
        (b"\xc6\xff\xff\xff\xff", "not MessagePack"),
        (b"\x91" * 200_000, "not MessagePack"),  # deeper than any stack
        (b"\xdd\x00\x10\x00\x00" + b"\x80" * 2**20, f"a message has at most {MAX_VALUES} values"),
        (b"\x91" * MAX_VALUES + b"\xc0", f"a message has at most {MAX_VALUES} values"),
        (bytes(MAX_BYTES + 1), f"a message has at most {MAX_BYTES} bytes"),
    ],
    ids=range(14),
)
def test_hostile_bytes_are_refused(content: bytes, problem: str) -> None:
    with pytest.raises(MessageError) as caught:
        unpack(content, OPENPI)
    assert str(caught.value).startswith(problem)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "not JSON"),
        (b"{", "not JSON"),
        (b"\xff", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b"[" + b"0," * MAX_VALUES + b"0]", f"a message has at most {MAX_VALUES} values"),
        (b"9" * 5000, "not JSON"),
        (b'{"__numpy__": "?", "dtype": "<f4", "shape": [1]}', "the message: an array's elements must be base64"),
        (b'{"__numpy__": "AA==", "dtype": "<f4", "shape": [1]}', "the message: an array <f4 of shape [1] has 4 bytes"),
    ],
    ids=range(8),
)
def test_hostile_json_is_refused(content: bytes, problem: str) -> None:
    with pytest.raises(MessageError) as caught:
        unpack_json(content)
    assert str(caught.value).startswith(problem)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_value_or_refused_in_one_line(content: bytes) -> None:
    assert refusal(partial(unpack, content, OPENPI)).isprintable()
    assert refusal(partial(unpack, content, LEBEDOV)).isprintable()
    assert refusal(partial(unpack_json, content)).isprintable()


@given(st.integers(0, 2**32))
def test_altered_messages_are_a_value_or_refused(seed: int) -> None:
    chance = random.Random(seed)
    for form in (OPENPI, LEBEDOV, NPY):
        content = bytearray(pack({"actions": np.zeros((2, 3), "<f4"), "s": np.float32(1)}, form))
        for _ in range(3):
            content[chance.randrange(len(content))] = chance.randrange(256)
        assert refusal(partial(unpack, bytes(content), form)).isprintable()


def refusal(read: Callable[[], object]) -> str:
    """Return the text with which bytes are refused, in one line; empty if they are read."""
    try:
        read()
    except MessageError as error:
        return str(error) if len(str(error)) < 500 else "\n"
    return ""
