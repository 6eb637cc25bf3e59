"""Conversions between messages and Cellwright's own values: units, quaternions, arrays.

Inside, time is whole nanoseconds and a quaternion is (w, x, y, z); in messages time is (sec, nanosec) and a quaternion
(x, y, z, w).
"""

import dataclasses
import math
import struct
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from cellwright.middleware.messages.standard import (
    Duration,
    GoalID,
    GoalStatus,
    Header,
    JointState,
    JointTrajectory,
    JointTrajectoryPoint,
    Point,
    Pose,
    Quaternion,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)
from cellwright.util.errors import MessageError
from cellwright.util.pose import IDENTITY_QUATERNION
from cellwright.util.pose import Pose as SpatialPose

NANOSECONDS = 1_000_000_000
UNIT_TOLERANCE = 1e-9  # a quaternion whose length differs from 1 by more is scaled
N = TypeVar("N", bound=np.generic)
M = TypeVar("M")
_HALF_SECONDS = 1 << 31  # half the range of a stamp's seconds

Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]  # value of a `float64[]` field

_NO_FLOATS: Floats = np.frombuffer(b"", np.float64)  # read-only, as all arrays of messages
Singles = np.ndarray[tuple[int, ...], np.dtype[np.float32]]  # value of a `float32[]` field

Counts = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]  # value of a `uint64[]` field


def stamp(time: int = 0) -> Time:
    """Return a point in simulation time [ns] as a message."""
    return Time(*divmod(time, NANOSECONDS))


def wrapped_stamp(time: int) -> Time:
    """Return a stamp that came from outside, in simulation time [ns], as a message.

    Seconds beyond 32 bits wrap, so that it can be written: nanoseconds from outside may exceed a second, and a clock
    that went on over a reset adds to stamps.
    """
    sec, nanosec = divmod(time, NANOSECONDS)
    return Time((sec + _HALF_SECONDS) % (2 * _HALF_SECONDS) - _HALF_SECONDS, nanosec)


def duration(time: int = 0) -> Duration:
    """Return a time span [ns] as a message; the nanoseconds of a negative one count upwards, as in ROS."""
    return Duration(*divmod(time, NANOSECONDS))


def nanoseconds(time: Time | Duration) -> int:
    """Return the whole nanoseconds of a time or duration message."""
    return time.sec * NANOSECONDS + time.nanosec


def shifted(message: M, by: int) -> M:
    """Return a message with all its stamps shifted by a time [ns]; a stamp of zero means none, and stays.

    Seconds wrap as in `wrapped_stamp`, so that any stamp can be shifted there and back.
    """
    if not by:
        return message
    old: Any = message
    changed = {each.name: _shifted_value(getattr(old, each.name), by) for each in dataclasses.fields(old) if each.init}
    new: M = dataclasses.replace(old, **changed)
    return new


def _shifted_value(value: Any, by: int) -> Any:
    if isinstance(value, Time):
        if not (time := nanoseconds(value)):
            return value
        return wrapped_stamp(time + by)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return shifted(value, by)
    return [_shifted_value(each, by) for each in value] if isinstance(value, list) else value


def header(frame: str = "", time: int = 0) -> Header:
    """Return a header: frame, and time [ns]."""
    return Header(stamp(time), frame)


def single(value: float) -> float:
    """Return the nearest number of single precision.

    Values of `float32` fields are rounded before publishing, so that a listener in this process gets the same number as
    one behind a socket.

    Raises:
        MessageError: the value is finite and beyond single precision.
    """
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        raise MessageError(f"{value!r} is beyond single precision") from None


def floats(values: ArrayLike = ()) -> Floats:
    """Return numbers as the value of a `float64[]` field: a read-only copy."""
    return _NO_FLOATS if isinstance(values, tuple) and not values else _numbers(values, np.float64)


def singles(values: ArrayLike = ()) -> Singles:
    """Return numbers as the value of a `float32[]` field: a read-only copy."""
    return _numbers(values, np.float32)


def counts(values: ArrayLike = ()) -> Counts:
    """Return numbers as the value of a `uint64[]` field: a read-only copy."""
    return _numbers(values, np.uint64)


def origin() -> Pose:
    """Return the identity pose as a message."""
    return Pose(Point(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))


def pose_message(pose: SpatialPose) -> Pose:
    """Return a pose as a message."""
    w, x, y, z = pose.quaternion
    return Pose(Point(*pose.position), Quaternion(x, y, z, w))


def pose_from_message(message: Pose) -> SpatialPose:
    """Return the pose in a message; a quaternion is scaled to unit length, and zero means no rotation.

    Raises:
        MessageError: one of the seven numbers is not finite.
    """
    return _spatial_pose(message.position, message.orientation)


def transform_message(pose: SpatialPose) -> Transform:
    """Return a pose as a transform message."""
    w, x, y, z = pose.quaternion
    return Transform(Vector3(*pose.position), Quaternion(x, y, z, w))


def pose_from_transform(message: Transform) -> SpatialPose:
    """Return the pose in a transform message; quaternions as in `pose_from_message`.

    Raises:
        MessageError: one of the seven numbers is not finite.
    """
    return _spatial_pose(message.translation, message.rotation)


def transform_stamped(parent: str, child: str, parent_T_child: SpatialPose, time: int) -> TransformStamped:
    """Return the transform of the frame `child` in the frame `parent` at `time` [ns]."""
    return TransformStamped(header(parent, time), child, transform_message(parent_T_child))


def trajectory_point(
    positions: ArrayLike = (),
    velocities: ArrayLike = (),
    accelerations: ArrayLike = (),
    effort: ArrayLike = (),
    time_from_start: int = 0,
) -> JointTrajectoryPoint:
    """Return a point of a joint trajectory [rad or m, N m or N]; `time_from_start` in ns."""
    return JointTrajectoryPoint(
        floats(positions), floats(velocities), floats(accelerations), floats(effort), duration(time_from_start)
    )


def joint_trajectory(
    names: Sequence[str] = (), points: Sequence[JointTrajectoryPoint] = (), *, frame: str = "", time: int = 0
) -> JointTrajectory:
    """Return a joint trajectory that starts at `time` [ns]; 0 means on arrival."""
    return JointTrajectory(header(frame, time), list(names), list(points))


def joint_state(
    names: Sequence[str] = (),
    positions: ArrayLike = (),
    velocities: ArrayLike = (),
    efforts: ArrayLike = (),
    *,
    frame: str = "",
    time: int = 0,
) -> JointState:
    """Return a joint state at `time` [ns]: positions [rad or m], velocities [per s], efforts [N m or N]."""
    return JointState(header(frame, time), list(names), floats(positions), floats(velocities), floats(efforts))


def goal_id() -> GoalID:
    """Return an empty goal identifier."""
    return GoalID(stamp(), "")


def goal_status() -> GoalStatus:
    """Return a goal status with an empty identifier."""
    return GoalStatus(goal_id(), GoalStatus.PENDING, "")


def _numbers(values: ArrayLike, dtype: type[N]) -> np.ndarray[tuple[int, ...], np.dtype[N]]:
    array = np.array(values, dtype)
    array.setflags(write=False)
    return array


def _spatial_pose(p: Point | Vector3, q: Quaternion) -> SpatialPose:
    position, quaternion = (p.x, p.y, p.z), (q.w, q.x, q.y, q.z)
    pose = SpatialPose(position, quaternion)
    length = math.hypot(*quaternion)
    if not pose.is_finite() or math.isinf(length):
        raise MessageError(f"a pose must be finite, not {position} {quaternion}")
    if length == 0.0:
        return SpatialPose(position, IDENTITY_QUATERNION)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        w, x, y, z = quaternion
        return SpatialPose(position, (w / length, x / length, y / length, z / length))
    return pose
