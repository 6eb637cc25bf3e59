"""Poses: position and orientation, in SI units.

Quaternions are (w, x, y, z) everywhere inside Cellwright. Messages carry (x, y, z, w), converted on input and output. A
pose variable reads `world_T_tray`: it takes coordinates in the tray frame to coordinates in the world frame, so that
`world_T_part = world_T_tray @ tray_T_part`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

Vector3: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]

IDENTITY_QUATERNION: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid transform: position [m] and unit quaternion (w, x, y, z).

    Example:
        >>> world_T_tray = Pose((1.0, 0.0, 0.5))
        >>> tray_T_part = Pose((0.1, 0.0, 0.0))
        >>> (world_T_tray @ tray_T_part).position
        (1.1, 0.0, 0.5)
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    quaternion: Quaternion = IDENTITY_QUATERNION

    @classmethod
    def from_rpy(cls, xyz: Vector3, rpy: Vector3 = (0.0, 0.0, 0.0)) -> Pose:
        """Return the pose at `xyz` [m] with roll, pitch, yaw [rad] about the fixed x, y, z axes (as URDF and SDF)."""
        return cls(xyz, quaternion_from_rpy(*rpy))

    @property
    def rpy(self) -> Vector3:
        """Roll, pitch, yaw [rad] about the fixed x, y, z axes."""
        return rpy_from_quaternion(self.quaternion)

    @property
    def yaw(self) -> float:
        """Yaw [rad] of the roll-pitch-yaw decomposition."""
        return self.rpy[2]

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose of `other`, given in this frame, in the parent frame of this pose."""
        return Pose(self.transform(other.position), quaternion_product(self.quaternion, other.quaternion))

    def inverse(self) -> Pose:
        """Return the inverse transform."""
        w, x, y, z = self.quaternion
        conjugate = (w, -x, -y, -z)
        px, py, pz = rotate(conjugate, self.position)
        return Pose((-px, -py, -pz), conjugate)

    def relative(self, other: Pose) -> Pose:
        """Return the pose of `other` in this frame, both given in the same parent frame: `self.inverse() @ other`."""
        return Pose(*relative(self.position, self.quaternion, other.position, other.quaternion))

    def transform(self, point: Vector3) -> Vector3:
        """Return a point [m], given in this frame, in the parent frame of this pose."""
        x, y, z = rotate(self.quaternion, point)
        return (x + self.position[0], y + self.position[1], z + self.position[2])

    def rotate(self, vector: Vector3) -> Vector3:
        """Return a free vector, given in this frame, in the parent frame of this pose."""
        return rotate(self.quaternion, vector)

    def is_finite(self) -> bool:
        """Return True if all seven numbers are finite."""
        return all(map(math.isfinite, (*self.position, *self.quaternion)))


def quaternion_product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the Hamilton product a b: first turn by b, then by a. Both (w, x, y, z)."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def rotate(q: Quaternion, v: Vector3) -> Vector3:
    """Rotate the vector `v` by the unit quaternion `q` (w, x, y, z)."""
    w, x, y, z = q
    vx, vy, vz = v
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx)


def relative(
    position: Sequence[float], quaternion: Sequence[float], other: Sequence[float], turn: Sequence[float]
) -> tuple[Vector3, Quaternion]:
    """Return the pose of another body in the frame of one; `Pose.relative` of the bare numbers, to the last bit.

    Args:
        position: position of the one [m].
        quaternion: its unit quaternion (w, x, y, z).
        other: position of the other [m], in the same frame.
        turn: its unit quaternion.
    """
    # `rotate` of both positions by the conjugate, without the calls: /tf takes hundreds of poses a second
    px, py, pz = position
    qx, qy, qz = other
    w, x, y, z = quaternion
    x, y, z = -x, -y, -z
    ax, ay, az = 2 * (y * pz - z * py), 2 * (z * px - x * pz), 2 * (x * py - y * px)
    bx, by, bz = 2 * (y * qz - z * qy), 2 * (z * qx - x * qz), 2 * (x * qy - y * qx)
    return (
        (
            (qx + w * bx + y * bz - z * by) - (px + w * ax + y * az - z * ay),
            (qy + w * by + z * bx - x * bz) - (py + w * ay + z * ax - x * az),
            (qz + w * bz + x * by - y * bx) - (pz + w * az + x * ay - y * ax),
        ),
        quaternion_product((w, x, y, z), (turn[0], turn[1], turn[2], turn[3])),
    )


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the unit quaternion (w, x, y, z) of roll, pitch, yaw [rad] about the fixed x, y, z axes."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def rpy_from_quaternion(q: Quaternion) -> Vector3:
    """Return roll, pitch, yaw [rad] about the fixed x, y, z axes of a unit quaternion (w, x, y, z).

    Pitch is clamped to +-pi/2 where rounding would carry its sine past 1.
    """
    w, x, y, z = q
    sin_pitch = max(-1.0, min(1.0, 2 * (w * y - x * z)))
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(sin_pitch),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def normalized(q: Quaternion) -> Quaternion:
    """Return the quaternion scaled to unit length; the identity for the zero quaternion."""
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm) if norm > 0 else IDENTITY_QUATERNION
