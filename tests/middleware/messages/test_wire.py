from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import header, joint_state
from cellwright.middleware.messages.osrf_gear import Order, Proximity, VacuumGripperState
from cellwright.middleware.messages.standard import Header, JointState, Range, String
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.util.errors import MessageError, UsageError
from tests.middleware.messages.random_messages import messages, same

NAMES = [
    *TYPES.own,
    *(
        f"{package}/msg/{name}"
        for package, name in (
            ("sensor_msgs", "JointState"),
            ("sensor_msgs", "LaserScan"),
            ("std_msgs", "Float32"),
            ("tf2_msgs", "TFMessage"),
            ("rosgraph_msgs", "Clock"),
            ("actionlib_msgs", "GoalStatusArray"),
        )
    ),
]
any_message = st.sampled_from(NAMES).flatmap(messages)


@pytest.mark.slow
@given(any_message)
def test_cdr_round_trip_keeps_message(message: Any) -> None:
    assert same(TYPES.from_cdr(TYPES.to_cdr(message), type(message)), message)


@given(any_message)
def test_ros1_round_trip_keeps_message(message: Any) -> None:
    assert same(TYPES.from_ros1(TYPES.to_ros1(message), type(message)), message)


@given(any_message)
def test_cdr_converted_to_ros1_equals_ros1_bytes(message: Any) -> None:
    """The library's conversion of bytes gives the same bytes as Cellwright's by way of the message."""
    assert bytes(TYPES.ros1.store.cdr_to_ros1(TYPES.to_cdr(message), message.__msgtype__)) == TYPES.to_ros1(message)


@pytest.mark.slow
@given(any_message)
def test_message_that_can_be_encoded_passes_validation(message: Any) -> None:
    assert TYPES.checked(message) is message


@pytest.mark.slow
@given(messages("sensor_msgs/msg/Range"))
def test_ros1_range_loses_variance_only(message: Range) -> None:
    back = TYPES.from_ros1(TYPES.to_ros1(message), Range)
    assert type(back) is Range
    assert back.variance == 0.0
    message.variance = 0.0
    assert same(back, message)


@pytest.mark.slow
@given(st.sampled_from(NAMES), st.binary(max_size=200))
def test_random_bytes_are_refused_or_round_trip(name: str, data: bytes) -> None:
    message_class = TYPES.message(name)
    for read, write in ((TYPES.from_cdr, TYPES.to_cdr), (TYPES.from_ros1, TYPES.to_ros1)):
        try:
            message = read(data, message_class)
        except MessageError:
            continue
        assert same(read(write(message), message_class), message)


def test_ros1_bytes_match_noetic_types() -> None:
    noetic = get_typestore(Stores.ROS1_NOETIC)
    real: Any = noetic.types
    stamp = real["builtin_interfaces/msg/Time"](12, 34)
    head = real["std_msgs/msg/Header"](0, stamp, "frame")
    values = 0, 0.5, 0.25, 2.0, 1.5
    expected = noetic.serialize_ros1(real["sensor_msgs/msg/Range"](head, *values), "sensor_msgs/msg/Range")
    ours = Range(header("frame", 12_000_000_034), *values, 9.0)
    assert TYPES.to_ros1(ours) == bytes(expected)

    joints = ["a", "b"], np.array([1.0, 2.0]), np.array([]), np.array([3.0])
    expected = noetic.serialize_ros1(real["sensor_msgs/msg/JointState"](head, *joints), "sensor_msgs/msg/JointState")
    assert TYPES.to_ros1(joint_state(["a", "b"], [1, 2], [], [3], frame="frame", time=12_000_000_034)) == bytes(
        expected
    )


def test_ros1_sequence_number_is_ignored() -> None:
    data = bytearray(TYPES.to_ros1(Proximity(header("beam", 5), True, 0.5, 1.0)))
    assert data[:4] == b"\0\0\0\0"
    data[:4] = b"\x07\0\0\0"
    assert TYPES.from_ros1(bytes(data), Proximity) == Proximity(header("beam", 5), True, 0.5, 1.0)


def test_encoded_bytes_match_hand_written_ones() -> None:
    assert TYPES.to_ros1(VacuumGripperState(True, False)) == b"\x01\x00"
    assert TYPES.to_cdr(VacuumGripperState(True, False)) == b"\x00\x01\x00\x00\x01\x00"
    assert TYPES.to_ros1(TriggerResponse(True, "ok")) == b"\x01\x02\x00\x00\x00ok"
    assert TYPES.to_ros1(TriggerRequest()) == b""
    assert TYPES.to_cdr(TriggerRequest()) == b"\x00\x01\x00\x00\x00"
    assert TYPES.from_cdr(b"\x00\x00\x00\x00" + b"\x00\x00\x00\x03" + b"hi\x00", String) == String("hi")  # big-endian


def test_bytes_of_other_type_are_refused() -> None:
    with pytest.raises(MessageError, match="invalid osrf_gear/Order in 2 bytes"):
        TYPES.from_ros1(b"\x01\x00", Order)
    with pytest.raises(MessageError, match="invalid std_msgs/String"):
        TYPES.from_cdr(b"\x00\x01\x00\x00\xff\xff\xff\xff", String)
    with pytest.raises(MessageError):
        TYPES.from_cdr(b"", String)


def test_message_that_cannot_be_encoded_names_field() -> None:
    with pytest.raises(MessageError, match=r"sensor_msgs/JointState\.position must be a sequence of float64"):
        TYPES.to_cdr(JointState(header(), ["a"], "1.0", np.array([]), np.array([])))  # type: ignore[arg-type]
    with pytest.raises(MessageError, match=r"std_msgs/Header\.stamp must be of type builtin_interfaces/Time, not None"):
        TYPES.to_ros1(Header(None, ""))  # type: ignore[arg-type]


def test_list_of_numbers_is_encoded_after_validation_only() -> None:
    message = JointState(header(), ["a"], [1.0], [], [])  # type: ignore[arg-type]
    with pytest.raises(MessageError, match="cannot encode"):
        TYPES.to_cdr(message)
    assert same(TYPES.from_cdr(TYPES.to_cdr(TYPES.checked(message)), JointState), joint_state(["a"], [1.0], time=0))


def test_type_with_other_fields_in_ros1_is_refused_there() -> None:
    marker_array: Any = TYPES.message("visualization_msgs/MarkerArray")
    assert TYPES.from_cdr(TYPES.to_cdr(marker_array([])), marker_array) == marker_array([])
    with pytest.raises(UsageError, match="different fields in ROS 1"):
        TYPES.to_ros1(marker_array([]))
    with pytest.raises(UsageError, match="different fields in ROS 1"):
        TYPES.from_ros1(b"\0\0\0\0", marker_array)
