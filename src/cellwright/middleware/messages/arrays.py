"""Arrays of messages: pictures, points and joint states as numpy arrays with their shape, for computing.

The functions read messages of any origin by their fields: Cellwright's own, those of rospy and those of rclpy.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.util.errors import MessageError

_ENCODINGS = {
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "mono8": ("u1", 1),
    "8UC1": ("u1", 1),
    "8UC3": ("u1", 3),
    "mono16": ("u2", 1),
    "16UC1": ("u2", 1),
    "32FC1": ("f4", 1),
    "32FC3": ("f4", 3),
    "64FC1": ("f8", 1),
}
"""Type of a number, and numbers in a pixel, by the encoding of a picture."""

_FLOAT32 = 7  # sensor_msgs/PointField.FLOAT32


class JointArrays(NamedTuple):
    """Joint states as arrays; entry n of each belongs to `names[n]`.

    An array is empty if the message has no such values.

    Attributes:
        names: names of the joints.
        positions: positions [rad; m], float64.
        velocities: velocities [rad/s; m/s], float64.
        efforts: efforts [N m; N], float64.
        time_ns: time of the message [ns].
    """

    names: tuple[str, ...]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    efforts: NDArray[np.float64]
    time_ns: int


def image_array(message: Any) -> NDArray[Any]:
    """Return the pixels of a picture (sensor_msgs/Image), read-only where no copy is needed.

    Returns:
        Shape (height, width, 3) for colours, as uint8 in the order of the encoding; (height, width) for one number in a
        pixel, such as depths [m] as float32.

    Raises:
        MessageError: the encoding is unknown, or the data do not fit the size.

    Example:
        >>> import numpy as np
        >>> from cellwright.middleware.messages.conversions import header
        >>> from cellwright.middleware.messages.standard import Image
        >>> image_array(Image(header("camera", 0), 2, 3, "rgb8", 0, 9, np.zeros(18, np.uint8))).shape
        (2, 3, 3)
    """
    if message.encoding not in _ENCODINGS:
        known = ", ".join(_ENCODINGS)
        raise MessageError(f"picture: encoding {message.encoding!r:.40} is unknown; convert it to one of {known}")
    kind, count = _ENCODINGS[message.encoding]
    number = np.dtype(f"{'>' if message.is_bigendian else '<'}{kind}")
    height, width, step = message.height, message.width, message.step
    if step < width * count * number.itemsize or step % number.itemsize or len(message.data) != height * step:
        raise MessageError(
            f"picture: {len(message.data)} bytes in rows of {step} do not fit {height} × {width} pixels "
            f"of {message.encoding}"
        )
    rows = np.frombuffer(message.data, number).reshape(height, step // number.itemsize)[:, : width * count]
    pixels = rows.reshape((height, width) if count == 1 else (height, width, count))
    return pixels.astype(number.newbyteorder("="), copy=False)


def points_array(message: Any) -> NDArray[np.float32]:
    """Return the points of a cloud (sensor_msgs/PointCloud2 or PointCloud) [m].

    Returns:
        Shape (height, width, 3), float32, for a PointCloud2; NaN where nothing was measured. Shape (points, 3) for a
        PointCloud.

    Raises:
        MessageError: a PointCloud2 has no fields x, y and z of float32, or its data do not fit the size.
    """
    if hasattr(message, "points"):
        listed = [(point.x, point.y, point.z) for point in message.points]
        return np.array(listed, np.float32).reshape(-1, 3)
    offsets = {field.name: field.offset for field in message.fields if field.datatype == _FLOAT32}
    if not {"x", "y", "z"} <= offsets.keys():
        raise MessageError("points: x, y and z of float32 are missing among the fields")
    height, width, step, row = message.height, message.width, message.point_step, message.row_step
    fits = all(0 <= offsets[axis] <= step - 4 for axis in "xyz") and row >= width * step
    if not fits or len(message.data) != height * row:
        raise MessageError(f"points: {len(message.data)} bytes do not fit {height} × {width} points of {step} bytes")
    data = np.frombuffer(message.data, np.uint8).reshape(height, row)[:, : width * step].reshape(height, width, step)
    number = np.dtype(">f4" if message.is_bigendian else "<f4")
    columns = [np.ascontiguousarray(data[..., offsets[axis] : offsets[axis] + 4]).view(number) for axis in "xyz"]
    return np.concatenate(columns, axis=-1).astype(np.float32)


def joint_arrays(message: Any) -> JointArrays:
    """Return joint states (sensor_msgs/JointState) as arrays, with the names of their joints.

    Example:
        >>> from cellwright import Cell, Client, Trial
        >>> client = Client.in_process(Cell(Trial("one arm", has_arm=True)))
        >>> joints = joint_arrays(client.joint_states.wait())
        >>> joints.names[0], joints.positions.shape
        ('elbow_joint', (8,))
    """
    positions, velocities, efforts = (
        np.array(each, np.float64) for each in (message.position, message.velocity, message.effort)
    )
    return JointArrays(tuple(message.name), positions, velocities, efforts, _time(message.header.stamp))


def _time(stamp: Any) -> int:
    """Return a stamp [ns]; rospy has other names for its fields."""
    return int(stamp.to_nsec()) if hasattr(stamp, "to_nsec") else nanoseconds(stamp)
