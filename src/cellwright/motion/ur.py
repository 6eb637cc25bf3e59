"""Kinematics in closed form of arms that are built as Universal Robots' are, with their lengths as a value.

In the frames of their robot descriptions joints 2, 3 and 4 turn about parallel y axes. So the arm lies in a vertical
plane, which is offset from the pan axis by d4. The inverse follows in three parts, each with two solutions:

- the plane, from the position of the wrist (over the left or the right shoulder);
- the wrist, from the Y-Z-Y Euler angles of the hand in that plane;
- the triangle of upper arm and forearm (elbow up or down).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from cellwright.motion.turns import principal
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose, Quaternion, Vector3, rotate

SAME = 1e-7
"""Difference [rad] below which solutions are one: at a fold, square roots amplify rounding no further."""

TOUCHING = 1e-7
"""Distance [m] by which a target may be out of reach and still count as at its edge: the effect of rounding where
two singularities meet."""

_SINGULAR = 1e-10
"""Sine of wrist 2 below which its neighbours turn about one axis, so that wrist 3 is a free choice."""

Angles: TypeAlias = tuple[float, float, float, float, float, float]
"""Angles [rad] of shoulder pan, shoulder lift, elbow, wrist 1, wrist 2 and wrist 3."""

Rows: TypeAlias = tuple[Vector3, Vector3, Vector3]


@dataclass(frozen=True, slots=True)
class UrConstants:
    """Lengths of an arm of this form [m], after Denavit and Hartenberg, all of them positive.

    Attributes:
        d1: height of the shoulder above the base.
        a2: length of the upper arm.
        a3: length of the forearm.
        d4: distance of the arm's plane from the pan axis.
        d5: distance of wrist 3 from wrist 1, along the axis of wrist 2.
        d6: distance of the flange from the origin of wrist 3, along its axis.
        shoulder_offset: distance of the frame of the upper arm from the pan axis, along its y. Newer descriptions have
            it at 0, and all of d4 between forearm and wrist 1; the kinematics of the tool are the same.
        elbow_offset: that of the frame of the forearm from the frame of the upper arm.
    """

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    shoulder_offset: float = 0.0
    elbow_offset: float = 0.0

    @property
    def max_reach(self) -> float:
        """Maximum distance of the axis of wrist 1 from that of the shoulder [m]."""
        return self.a2 + self.a3


def ur_links(ur: UrConstants, base: Pose, angles: Sequence[float]) -> dict[str, Pose]:
    """Return the poses of the links that the joints move, by the names of the robot description, with `base` above all.

    Args:
        ur: lengths of the arm.
        base: pose of `base_link` [m] in any frame, which is that of the result.
        angles: of shoulder pan, shoulder lift, elbow and the wrists [rad].
    """
    pan, lift, elbow, wrist_1, wrist_2, wrist_3 = angles
    quarter = math.pi / 2
    shoulder = base @ Pose((0.0, 0.0, ur.d1), _about_z(pan))
    upper_arm = shoulder @ Pose((0.0, ur.shoulder_offset, 0.0), _about_y(quarter + lift))
    forearm = upper_arm @ Pose((0.0, ur.elbow_offset, ur.a2), _about_y(elbow))
    first = forearm @ Pose((0.0, 0.0, ur.a3), _about_y(quarter + wrist_1))
    second = first @ Pose((0.0, ur.d4 - ur.shoulder_offset - ur.elbow_offset, 0.0), _about_z(wrist_2))
    return {
        "shoulder_link": shoulder,
        "upper_arm_link": upper_arm,
        "forearm_link": forearm,
        "wrist_1_link": first,
        "wrist_2_link": second,
        "wrist_3_link": second @ Pose((0.0, 0.0, ur.d5), _about_y(wrist_3)),
    }


def ur_postures(
    ur: UrConstants, shoulder_T_wrist_3: Pose, free_wrist_3: float = 0.0, *, rail: float | None = None
) -> list[Angles]:
    """Return all postures, up to eight, that bring wrist 3 to a pose; angles are from -pi to pi.

    Args:
        ur: lengths of the arm.
        shoulder_T_wrist_3: the pose [m], with a unit quaternion, in the frame of the shoulder. That is the frame of
            `base_link`, raised by d1.
        free_wrist_3: angle of wrist 3 [rad] where the pose leaves it free, since wrists 1 and 3 turn about one axis.
        rail: position [m] of the rail that carries the arm, for messages.

    Raises:
        UnreachableError: there is no posture; the text says why.
    """
    a2, a3, d5 = ur.a2, ur.a3, ur.d5
    max_reach, min_reach = a2 + a3, abs(a2 - a3)
    wrist_3 = shoulder_T_wrist_3.position
    up = wrist_3[2]
    rows = _rows(shoulder_T_wrist_3.quaternion)
    found: list[Angles] = []
    min_excess = math.inf
    for pan in _pan_angles(ur.d4, wrist_3, rail):
        outward = wrist_3[0] * math.cos(pan) + wrist_3[1] * math.sin(pan)
        first = principal(pan)
        for plane, wrist_2, wrist_3_angle in _wrist_solutions(ur, _turned_back(pan, rows), outward, up, free_wrist_3):
            # Wrist 1 is d5 behind the origin of wrist 3, along the hand's direction in the plane.
            x, z = outward - d5 * math.sin(plane), up - d5 * math.cos(plane)
            distance = math.hypot(x, z)
            excess = max(distance - max_reach, min_reach - distance)
            if excess > TOUCHING:
                min_excess = min(min_excess, excess)
                continue
            # The triangle of upper arm a2, forearm a3 and the line r from shoulder to wrist 1: by the law of cosines
            # r^2 = a2^2 + a3^2 + 2 a2 a3 cos(elbow). Elbow up and elbow down are mirror images about that line.
            bend = math.acos(max(-1.0, min(1.0, (distance**2 - a2**2 - a3**2) / (2 * a2 * a3))))
            to_wrist_1, last = math.atan2(-z, x), (principal(wrist_2), principal(wrist_3_angle))
            for elbow in (bend, -bend):
                # A larger lift lowers the upper arm, hence -z; the second term is the angle from r to the upper arm.
                # The angles of the three parallel joints sum up to the plane angle, half a turn apart at zero.
                lift = to_wrist_1 - math.atan2(a3 * math.sin(elbow), a2 + a3 * math.cos(elbow))
                angles = (first, principal(lift), elbow, principal(plane - math.pi - lift - elbow), *last)
                if not _is_among(angles, found):
                    found.append(angles)
    if not found:
        where = "" if rail is None else f" with the rail at {rail:.3f} m"
        raise UnreachableError(f"the wrist is {min_excess * 1000:.1f} mm out of reach{where}")
    return found


def _pan_angles(d4: float, wrist_3: Vector3, rail: float | None) -> tuple[float, ...]:
    """Return the pan angles [rad] for which the arm's plane, d4 off the pan axis, contains the origin of wrist 3."""
    distance = math.hypot(wrist_3[0], wrist_3[1])
    if distance < d4 - TOUCHING:
        remedy = "" if rail is None else "; move the rail"
        raise UnreachableError(f"wrist 3 must be at least {d4:.3f} m from the pan axis (got {distance:.3f} m){remedy}")
    # Seen from above, the arm's plane is a line at the distance d4 from the pan axis, and wrist 3 a point on it: so
    # sin(direction - pan) = d4 / distance. The arm over its other shoulder is the second solution of the sine.
    direction = math.atan2(wrist_3[1], wrist_3[0])
    aside = math.asin(min(1.0, d4 / distance))
    return direction - aside, direction + aside - math.pi


def _wrist_solutions(
    ur: UrConstants, pan_R_wrist_3: Rows, outward: float, up: float, free_wrist_3: float
) -> Iterator[tuple[float, float, float]]:
    """Yield the two sets of Y-Z-Y Euler angles [rad] of the hand in the arm's plane: plane angle, wrist 2 and wrist 3.

    `outward` and `up` [m] lead from the shoulder to the origin of wrist 3, in the plane. A free plane angle leaves
    wrist 3 at `free_wrist_3` [rad]. Where the arm does not reach so far, it is the nearest one within reach.
    """
    # The matrix is Ry(plane) Rz(wrist 2) Ry(wrist 3). Its middle column, which the last turn leaves as it is, is
    # (-cos(plane) sin(wrist 2), cos(wrist 2), sin(plane) sin(wrist 2)). It gives a plane for either sign of wrist 2.
    (m00, m01, m02), (_, m11, _), (m20, m21, m22) = pan_R_wrist_3
    if math.hypot(m01, m21) > _SINGULAR:
        planes: tuple[float, ...] = (math.atan2(m21, -m01), math.atan2(-m21, m01))
    elif m11 > 0.0:
        # the whole rotation is one about y, by the sum of the two angles
        planes = (_plane_in_reach(ur, outward, up, math.atan2(m02, m00) - free_wrist_3),)
    else:
        # ... or by their difference, with half a turn about z
        planes = (_plane_in_reach(ur, outward, up, math.atan2(m02, -m00) + free_wrist_3),)
    for plane in planes:
        c, s = math.cos(plane), math.sin(plane)
        # Without the first turn, Rz(wrist 2) Ry(wrist 3) remains. Reading both from it, and not from the
        # matrix, keeps their sum exact where each alone is ill defined.
        yield plane, math.atan2(-(c * m01 - s * m21), m11), math.atan2(-(s * m00 + c * m20), s * m02 + c * m22)


def _plane_in_reach(ur: UrConstants, outward: float, up: float, target: float) -> float:
    """Return the plane angle [rad] nearest to the target with wrist 1 in reach, or the target if there is none."""
    distance = math.hypot(outward, up)
    direction = math.atan2(outward, up)
    to_wrist_1 = math.hypot(outward - ur.d5 * math.sin(target), up - ur.d5 * math.cos(target))
    limit = min(ur.max_reach, max(abs(ur.a2 - ur.a3), to_wrist_1))
    if limit == to_wrist_1 or distance == 0.0 or ur.d5 == 0.0:
        return target
    # Wrist 1 is d5 from the origin of wrist 3, in the direction of the plane angle: the law of cosines.
    aside = math.acos(max(-1.0, min(1.0, (distance**2 + ur.d5**2 - limit**2) / (2 * distance * ur.d5))))
    return min((direction + aside, direction - aside), key=lambda angle: abs(principal(angle - target)))


def _turned_back(pan: float, rows: Rows) -> Rows:
    """Return Rz(-pan) times the matrix."""
    c, s = math.cos(pan), math.sin(pan)
    (a, b, d), (e, f, g), last = rows
    return (c * a + s * e, c * b + s * f, c * d + s * g), (c * e - s * a, c * f - s * b, c * g - s * d), last


def _rows(q: Quaternion) -> Rows:
    """Return the rotation matrix of a unit quaternion."""
    x, y, z = rotate(q, (1.0, 0.0, 0.0)), rotate(q, (0.0, 1.0, 0.0)), rotate(q, (0.0, 0.0, 1.0))
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def _is_among(angles: Angles, others: list[Angles]) -> bool:
    """Return whether a posture is one of others, but for rounding."""
    lift = angles[1]
    for other in others:
        # mostly this one angle tells them apart
        if SAME <= abs(lift - other[1]) <= math.pi:
            continue
        for mine, its in zip(angles, other, strict=True):
            apart = abs(mine - its)
            # up to half a turn it is its own principal angle
            if (apart if apart <= math.pi else abs(principal(apart))) >= SAME:
                break
        else:
            return True
    return False


def _about_y(angle: float) -> Quaternion:
    return (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)


def _about_z(angle: float) -> Quaternion:
    return (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))
