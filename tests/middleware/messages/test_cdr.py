"""CDR writers: the same bytes as the library's, for every type."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import floats, header, joint_state
from cellwright.middleware.messages.osrf_gear import DetectedObject, TrayContents
from cellwright.middleware.messages.standard import CameraInfo, JointState, RegionOfInterest, String
from cellwright.util.errors import MessageError
from tests.middleware.messages.random_messages import messages, same

NAMES = sorted(TYPES.ros2.fielddefs)


def by_the_library(message: Any) -> bytes:
    return bytes(TYPES.ros2.serialize_cdr(message, message.__msgtype__, little_endian=True))


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.sampled_from(NAMES).flatmap(messages))
def test_cdr_writer_of_random_message_matches_library(message: Any) -> None:
    assert TYPES.cdr_writer(message.__msgtype__)(message) == by_the_library(message)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "osrf_gear/msg/LogicalCameraImage",  # numbers of eight bytes behind strings, in a loop
        "trajectory_msgs/msg/JointTrajectory",  # arrays in a loop
        "sensor_msgs/msg/CameraInfo",  # arrays of a fixed length
        "visualization_msgs/msg/InteractiveMarker",  # loops in loops
        "sensor_msgs/msg/PointCloud2",  # fields behind single bytes
        "statistics_msgs/msg/MetricsMessage",
    ],
)
def test_cdr_writer_of_each_layout_matches_library(name: str) -> None:
    @settings(max_examples=60, deadline=None)
    @given(messages(name))
    def check(message: Any) -> None:
        assert TYPES.cdr_writer(name)(message) == by_the_library(message)
        assert same(TYPES.from_cdr(TYPES.cdr_writer(name)(message), type(message)), message)

    check()


def test_cdr_writer_exists_for_every_type() -> None:
    assert len(NAMES) > 200
    assert all(callable(TYPES.cdr_writer(name)) for name in NAMES)


@pytest.mark.parametrize("length", range(9))
def test_cdr_writer_aligns_fields_after_strings(length: int) -> None:
    tray = TrayContents("t" * length, [DetectedObject("d" * n, True) for n in range(length)])
    assert TYPES.to_cdr(tray) == by_the_library(tray)
    joints = joint_state(["j" * n for n in range(length)], range(length), (), [1.0], frame="f" * length, time=5)
    assert TYPES.to_cdr(joints) == by_the_library(joints)


@pytest.mark.parametrize(
    "values", [np.array([1, 2]), np.array([1.0], np.float32), np.array([[1.0, 2.0]]), np.array(1.0), np.array(["1.0"])]
)
def test_cdr_array_of_other_type_or_shape_is_refused(values: Any) -> None:
    with pytest.raises(MessageError):
        TYPES.to_cdr(JointState(header(), [], values, floats(), floats()))


def test_cdr_array_with_strides_or_big_endian_is_converted() -> None:
    numbers = np.arange(6.0)
    for values in (numbers[::2], numbers[::2].astype(">f8")):
        written = TYPES.to_cdr(JointState(header(), [], values, floats(), floats()))
        assert same(TYPES.from_cdr(written, JointState).position, np.array([0.0, 2.0, 4.0]))


def test_cdr_array_of_wrong_fixed_length_is_refused() -> None:
    region = RegionOfInterest(0, 0, 0, 0, False)
    three, nine, twelve = (np.zeros(count) for count in (3, 9, 12))
    whole = CameraInfo(header(), 1, 1, "", floats(), nine, nine, twelve, 0, 0, region)
    assert TYPES.to_cdr(whole) == by_the_library(whole)
    with pytest.raises(MessageError, match=r"CameraInfo\.k must have 9 entries, not 3"):
        TYPES.to_cdr(CameraInfo(header(), 1, 1, "", floats(), three, nine, twelve, 0, 0, region))


@pytest.mark.parametrize("value", [None, 5, b"text", ["text"], "\ud800"])
def test_cdr_string_of_other_type_is_refused(value: Any) -> None:
    with pytest.raises(MessageError, match=r"std_msgs/String\.data"):
        TYPES.to_cdr(String(value))
    with pytest.raises(MessageError, match=r"sensor_msgs/JointState\.name"):
        TYPES.to_cdr(JointState(header(), [value], floats(), floats(), floats()))
