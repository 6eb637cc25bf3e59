"""Decoded messages fit their type, so that they need no validation."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.util.errors import MessageError, UsageError
from tests.middleware.messages.random_messages import messages

NAMES = sorted(name for name in TYPES.ros2.fielddefs if not TYPES.has_bounds(name))
FORMS = ["cdr", "big-endian cdr", "ros1"]


def encoded(message: Any, form: str) -> bytes:
    if form == "ros1":
        try:
            return TYPES.to_ros1(message)
        except UsageError:  # it has no such encoding
            return b""
    return bytes(TYPES.ros2.serialize_cdr(message, message.__msgtype__, little_endian=form == "cdr"))


def decoded(name: str, data: bytes, form: str) -> Any:
    try:
        return (TYPES.from_ros1 if form == "ros1" else TYPES.from_cdr)(data, TYPES.message(name))
    except (MessageError, UsageError):
        return None


def is_as_its_type_says(message: Any) -> bool:
    return message is None or TYPES.checked(message) is message


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_decoded_message_passes_validation_unchanged(form: str, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(NAMES))
    written = bytearray(encoded(data.draw(messages(name)), form))
    assert not written or decoded(name, bytes(written), form) is not None
    assert is_as_its_type_says(decoded(name, bytes(written), form))
    for _ in range(data.draw(st.integers(1, 8)) if written else 0):
        written[data.draw(st.integers(0, len(written) - 1))] = data.draw(st.integers(0, 255))
    assert is_as_its_type_says(decoded(name, bytes(written), form))


@pytest.mark.parametrize("form", FORMS)
@given(data=st.binary(max_size=200))
def test_random_bytes_decode_to_valid_messages_or_are_refused(form: str, data: bytes) -> None:
    head = {"cdr": b"\0\1\0\0", "big-endian cdr": b"\0\0\0\0"}.get(form, b"")
    for name in NAMES:
        for each in (data, data + bytes(200)):  # zeros end strings and sequences, so that more of it decodes
            assert is_as_its_type_says(decoded(name, head + each, form)), name


def test_has_bounds_finds_bounded_types() -> None:
    assert TYPES.has_bounds("shape_msgs/msg/SolidPrimitive")  # float64[<=3]
    assert TYPES.has_bounds("type_description_interfaces/msg/TypeDescription")  # string<=255 in a message in a message
    assert not any(map(TYPES.has_bounds, TYPES.own))
    assert len(NAMES) > 190
