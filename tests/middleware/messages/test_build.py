import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import (
    duration,
    floats,
    header,
    joint_state,
    nanoseconds,
    origin,
    pose_from_message,
    pose_from_transform,
    pose_message,
    single,
    singles,
    stamp,
    transform_message,
    transform_stamped,
)
from cellwright.middleware.messages.standard import Float32, Quaternion
from cellwright.middleware.messages.standard import Pose as PoseMessage
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose, normalized, quaternion_product

coordinates = st.floats(-1e3, 1e3)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 1e-3).map(lambda q: normalized(q))
poses = st.builds(Pose, st.tuples(coordinates, coordinates, coordinates), quaternions)


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_time_round_trip_keeps_nanoseconds(time: int) -> None:
    assert nanoseconds(stamp(time)) == time
    assert 0 <= stamp(time).nanosec < 10**9


@given(st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1))
def test_duration_round_trip_keeps_nanoseconds(time: int) -> None:
    message = duration(time)
    assert nanoseconds(message) == time
    assert 0 <= message.nanosec < 10**9
    assert TYPES.to_cdr(message)


def test_time_and_duration_split_into_seconds_and_nanoseconds() -> None:
    assert (stamp(1_500_000_000).sec, stamp(1_500_000_000).nanosec) == (1, 500_000_000)
    assert (duration(-1).sec, duration(-1).nanosec) == (-1, 999_999_999)
    assert header("world", 7).frame_id == "world"
    assert nanoseconds(header("world", 7).stamp) == 7


@given(poses)
def test_pose_round_trip_is_exact(pose: Pose) -> None:
    assert pose_from_message(pose_message(pose)) == pose
    assert pose_from_transform(transform_message(pose)) == pose


def test_pose_message_has_quaternion_in_xyzw_order() -> None:
    message = pose_message(Pose((1.0, 2.0, 3.0), (0.5, -0.5, 0.5, -0.5)))
    q = message.orientation
    assert (q.x, q.y, q.z, q.w) == (-0.5, 0.5, -0.5, 0.5)
    assert (message.position.x, message.position.y, message.position.z) == (1.0, 2.0, 3.0)
    assert pose_from_message(message).rotate((1.0, 0.0, 0.0)) == Pose((0, 0, 0), (0.5, -0.5, 0.5, -0.5)).rotate(
        (1, 0, 0)
    )


@given(poses, poses)
def test_product_of_poses_survives_messages(a: Pose, b: Pose) -> None:
    """The product of two poses is the same through messages."""
    product = a @ b
    through = pose_from_message(pose_message(a)) @ pose_from_message(pose_message(b))
    assert product == through
    assert product.quaternion == quaternion_product(a.quaternion, b.quaternion)


@given(quaternions, st.floats(0.01, 100))
def test_quaternion_of_other_length_is_normalized(q: tuple[float, float, float, float], length: float) -> None:
    w, x, y, z = (v * length for v in q)
    taken = pose_from_message(PoseMessage(origin().position, Quaternion(x, y, z, w))).quaternion
    assert taken == pytest.approx(q, abs=1e-9)


def test_quaternion_of_zeros_is_identity() -> None:
    assert pose_from_message(PoseMessage(origin().position, Quaternion(0.0, 0.0, 0.0, 0.0))) == Pose()
    assert pose_from_message(origin()) == Pose()


@pytest.mark.parametrize("value", [math.nan, math.inf, 1.7e308])
def test_pose_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(MessageError, match="must be finite"):
        pose_from_message(PoseMessage(origin().position, Quaternion(value, value, value, value)))


def test_transform_stamped_has_frames_and_translation() -> None:
    message = transform_stamped("world", "tray", Pose((1.0, 2.0, 3.0)), 5)
    assert (message.header.frame_id, message.child_frame_id, message.transform.translation.z) == ("world", "tray", 3.0)


@given(st.floats(width=32))
def test_single_of_float32_value_is_unchanged(value: float) -> None:
    assert single(value) == value or math.isnan(value)


def test_single_equals_decoded_float32() -> None:
    assert TYPES.from_cdr(TYPES.to_cdr(Float32(0.1)), Float32).data == single(0.1) != 0.1
    with pytest.raises(MessageError, match="beyond single precision"):
        single(1e39)


def test_array_fields_are_read_only_copies() -> None:
    mine = np.array([1.0, 2.0])
    for array, dtype in ((floats(mine), np.float64), (singles([1, 2]), np.float32)):
        assert array.tolist() == [1.0, 2.0]
        assert array.dtype == dtype
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    message = joint_state(["a", "b"], mine, time=1)
    mine[0] = 9.0
    assert message.position.tolist() == [1.0, 2.0]
    assert message.velocity.tolist() == []
