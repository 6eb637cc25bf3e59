"""Conversions between messages and Cellwright's own values: units, quaternions, arrays.

Inside, time is whole nanoseconds and a quaternion is (w, x, y, z); in messages time is (sec, nanosec) and a quaternion
(x, y, z, w).
"""

import math
import struct
from collections.abc import Sequence
from typing import TypeVar

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
UNIT_TOLERANCE = 1e-9  # how far the length of a quaternion may be from 1 and still be taken as it is
N = TypeVar("N", bound=np.generic)

Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]  # what a `float64[]` field holds

Singles = np.ndarray[tuple[int, ...], np.dtype[np.float32]]  # what a `float32[]` field holds

Counts = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]  # what a `uint64[]` field holds


def stamp(time: int = 0) -> Time:
    """A point in simulation time [ns] as a message."""
    return Time(*divmod(time, NANOSECONDS))


def duration(time: int = 0) -> Duration:
    """A span of time [ns] as a message; the nanoseconds of a negative one count upwards, as in ROS."""
    return Duration(*divmod(time, NANOSECONDS))


def nanoseconds(time: Time | Duration) -> int:
    """Whole nanoseconds of a time or duration message."""
    return time.sec * NANOSECONDS + time.nanosec


def header(frame: str = "", time: int = 0) -> Header:
    """A header: frame, and time [ns]."""
    return Header(stamp(time), frame)


def single(value: float) -> float:
    """The nearest number of single precision.

    What goes into a `float32` field is rounded before it is published, so that a listener in this process sees the
    number that one behind a wire sees.

    Raises:
        MessageError: the value is finite and beyond single precision.
    """
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        raise MessageError(f"{value!r} is beyond single precision") from None


def floats(values: ArrayLike = ()) -> Floats:
    """Numbers as a `float64[]` field holds them: a read-only array of their own."""
    return _numbers(values, np.float64)


def singles(values: ArrayLike = ()) -> Singles:
    """Numbers as a `float32[]` field holds them: a read-only array of their own."""
    return _numbers(values, np.float32)


def counts(values: ArrayLike = ()) -> Counts:
    """Numbers as a `uint64[]` field holds them: a read-only array of their own."""
    return _numbers(values, np.uint64)


def origin() -> Pose:
    """The pose message of an unturned thing at the origin."""
    return Pose(Point(0.0, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))


def pose_message(pose: SpatialPose) -> Pose:
    """A pose as a message."""
    return Pose(Point(*pose.position), _quaternion_message(pose))


def pose_from_message(message: Pose) -> SpatialPose:
    """The pose in a message; a quaternion that is not of unit length is scaled, zero means not turned.

    Raises:
        MessageError: one of the seven numbers is not finite.
    """
    return _spatial_pose(message.position, message.orientation)


def transform_message(pose: SpatialPose) -> Transform:
    """A pose as a transform message."""
    return Transform(Vector3(*pose.position), _quaternion_message(pose))


def pose_from_transform(message: Transform) -> SpatialPose:
    """The pose in a transform message; quaternions as in `pose_from_message`.

    Raises:
        MessageError: one of the seven numbers is not finite.
    """
    return _spatial_pose(message.translation, message.rotation)


def transform_stamped(parent: str, child: str, parent_T_child: SpatialPose, time: int) -> TransformStamped:
    """Where the frame `child` stands in the frame `parent` at `time` [ns]."""
    return TransformStamped(header(parent, time), child, transform_message(parent_T_child))


def trajectory_point(
    positions: ArrayLike = (),
    velocities: ArrayLike = (),
    accelerations: ArrayLike = (),
    effort: ArrayLike = (),
    time_from_start: int = 0,
) -> JointTrajectoryPoint:
    """A point of a joint trajectory [rad or m, N m or N], `time_from_start` in ns."""
    return JointTrajectoryPoint(
        floats(positions), floats(velocities), floats(accelerations), floats(effort), duration(time_from_start)
    )


def joint_trajectory(
    names: Sequence[str] = (), points: Sequence[JointTrajectoryPoint] = (), *, frame: str = "", time: int = 0
) -> JointTrajectory:
    """A joint trajectory that starts at `time` [ns]; 0 means on arrival."""
    return JointTrajectory(header(frame, time), list(names), list(points))


def joint_state(
    names: Sequence[str],
    positions: ArrayLike,
    velocities: ArrayLike = (),
    efforts: ArrayLike = (),
    *,
    frame: str = "",
    time: int,
) -> JointState:
    """Joints at `time` [ns]: positions [rad or m], velocities [per s], efforts [N m or N]."""
    return JointState(header(frame, time), list(names), floats(positions), floats(velocities), floats(efforts))


def goal_id() -> GoalID:
    """The identifier of no goal."""
    return GoalID(stamp(), "")


def goal_status() -> GoalStatus:
    """The status of no goal."""
    return GoalStatus(goal_id(), GoalStatus.PENDING, "")


def _numbers(values: ArrayLike, dtype: type[N]) -> np.ndarray[tuple[int, ...], np.dtype[N]]:
    array = np.array(values, dtype=dtype)
    array.flags.writeable = False
    return array


def _quaternion_message(pose: SpatialPose) -> Quaternion:
    w, x, y, z = pose.quaternion
    return Quaternion(x, y, z, w)


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
