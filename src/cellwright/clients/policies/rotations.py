"""Forms in which policies give rotations: axis and angle, quaternions, Euler angles, and two columns of a matrix."""

import math
from collections.abc import Sequence
from typing import Final, Literal, TypeAlias

from cellwright.util.errors import UsageError
from cellwright.util.pose import Quaternion, Vector3, normalized, quaternion_from_rpy, rotate, rpy_from_quaternion

Form: TypeAlias = Literal["axis_angle", "quaternion_xyzw", "quaternion_wxyz", "euler_xyz", "rot6d", "none"]

SIZES: Final[dict[str, int]] = {
    "axis_angle": 3,
    "quaternion_xyzw": 4,
    "quaternion_wxyz": 4,
    "euler_xyz": 3,
    "rot6d": 6,
    "none": 0,
}
"""Count of numbers of a form. `euler_xyz` is roll, pitch, yaw about the fixed axes [rad]; `rot6d` the first column of
the matrix, then the second (Zhou et al. 2019, arXiv 1812.07035); `none` leaves the rotation out.
"""
_LEAST = 1e-9


def numbers_of(rotation: Quaternion, form: str) -> tuple[float, ...]:
    """Return a rotation, a unit quaternion (w, x, y, z), in a form.

    Example:
        >>> [round(each, 3) for each in numbers_of((math.cos(0.5), 0.0, 0.0, math.sin(0.5)), "axis_angle")]
        [0.0, 0.0, 1.0]
    """
    w, x, y, z = rotation
    match form:
        case "axis_angle":
            return rotation_vector(rotation)
        case "quaternion_wxyz":
            return rotation
        case "quaternion_xyzw":
            return (x, y, z, w)
        case "euler_xyz":
            return rpy_from_quaternion(rotation)
        case "rot6d":
            return (*rotate(rotation, (1.0, 0.0, 0.0)), *rotate(rotation, (0.0, 1.0, 0.0)))
    return ()


def rotation_of(numbers: Sequence[float], form: str) -> Quaternion:
    """Return the unit quaternion (w, x, y, z) of a rotation in a form; quaternions are brought to unit length.

    Raises:
        UsageError: the numbers are no rotation: a quaternion of 0, or columns along one line.
    """
    given = tuple(map(float, numbers))
    match form:
        case "axis_angle":
            return _turn((given[0], given[1], given[2]))
        case "quaternion_wxyz" | "quaternion_xyzw":
            a, b, c, d = given
            if math.hypot(a, b, c, d) < _LEAST:
                raise UsageError(f"{form}: must not be 0 (got {list(given)})")
            return normalized((a, b, c, d) if form == "quaternion_wxyz" else (d, a, b, c))
        case "euler_xyz":
            return quaternion_from_rpy(*given)
        case "rot6d":
            return _of_columns((given[0], given[1], given[2]), (given[3], given[4], given[5]))
    return (1.0, 0.0, 0.0, 0.0)


def rotation_vector(rotation: Quaternion) -> Vector3:
    """Return axis times angle [rad] of a unit quaternion (w, x, y, z); the angle is pi at most."""
    w, x, y, z = rotation if rotation[0] >= 0.0 else (-each for each in rotation)
    length = math.hypot(x, y, z)
    # the angle over the sine of its half tends to 2
    factor = 2.0 * math.atan2(length, w) / length if length > _LEAST else 2.0
    return (factor * x, factor * y, factor * z)


def _turn(vector: Vector3) -> Quaternion:
    """Return the unit quaternion of axis times angle [rad]."""
    angle = math.hypot(*vector)
    factor = math.sin(angle / 2.0) / angle if angle > _LEAST else 0.5
    x, y, z = (factor * each for each in vector)
    return normalized((math.cos(angle / 2.0), x, y, z))


def _of_columns(first: Vector3, second: Vector3) -> Quaternion:
    """Return the rotation whose matrix has these directions as first columns, made right-angled (Gram-Schmidt)."""
    ax, ay, az = _unit(first)
    along = ax * second[0] + ay * second[1] + az * second[2]
    bx, by, bz = _unit((second[0] - along * ax, second[1] - along * ay, second[2] - along * az))
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    # the largest of the four is found from the diagonal, the others from it (Shepperd 1978)
    squares = (1.0 + ax + by + cz, 1.0 + ax - by - cz, 1.0 - ax + by - cz, 1.0 - ax - by + cz)
    largest = max(range(4), key=squares.__getitem__)
    rows = (
        (squares[0], bz - cy, cx - az, ay - bx),
        (bz - cy, squares[1], ay + bx, cx + az),
        (cx - az, ay + bx, squares[2], bz + cy),
        (ay - bx, cx + az, bz + cy, squares[3]),
    )
    return normalized(rows[largest])


def _unit(vector: Vector3) -> Vector3:
    length = math.hypot(*vector)
    if length < _LEAST:
        raise UsageError("rot6d: its two columns must not be 0 nor along one line; check the order of the numbers")
    return (vector[0] / length, vector[1] / length, vector[2] / length)
