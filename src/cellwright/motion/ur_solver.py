"""Solver in closed form of arms that are built as Universal Robots' are, recognised by their axes.

A chain has this form if joints 2, 3 and 4 turn about parallel axes and each of the others meets its neighbours at right
angles: axis 1 meets axis 2, axis 5 meets axes 4 and 6. Names, frames, directions of axes and zeros of angles do not
matter. They differ between robot descriptions, and even between versions of one. Each angle of the form is the joint's
own position with a sign and an offset.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.motion.chain import Chain, ChainArm
from cellwright.motion.solver import MAX_STEP, Vector, largest_step, travel
from cellwright.motion.turns import nearest_turn
from cellwright.motion.ur import UrConstants, ur_links, ur_postures
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose, Quaternion, normalized

_ANGLE, _LENGTH = 1e-6, 1e-6
"""Largest deviation of axes from parallel or at right angles [rad], and of axes that meet [m]: rounding of files."""

_MIN_OFFSET = 1e-3
"""Smallest d4, and smallest a2 and a3 [m]: without them the formulas have no solution, or infinitely many."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class UrForm:
    """A chain in the form of Universal Robots' arms: angle i of the form is `signs[i] * q[i] + offsets[i]`.

    Attributes:
        constants: lengths of the arm. d1 is the height of the shoulder above the base along the pan axis, d6 the
            distance of the tool from wrist 3 along the axis of wrist 3. Link frames play no part, so the offsets are 0.
        base_T_shoulder: frame of the shoulder [m].
        wrist_3_T_tool: frame of the tool [m].
        signs: 1 or -1 a joint.
        offsets: [rad].
    """

    constants: UrConstants
    base_T_shoulder: Pose
    wrist_3_T_tool: Pose
    signs: Vector
    offsets: Vector


class UrSolver(ChainArm):
    """Solver in closed form: all postures, up to eight, exactly.

    Args:
        chain: the arm.
        form: its form, by `ur_form`.
        home: home posture [rad].
    """

    def __init__(self, chain: Chain, form: UrForm, home: Sequence[float]) -> None:
        super().__init__(chain, home)
        self.form = form
        self._shoulder_T_base = form.base_T_shoulder.inverse()
        self._tool_T_wrist_3 = form.wrist_3_T_tool.inverse()

    def branches(self, base_T_tool: Pose, near: Sequence[float]) -> Iterator[Vector]:
        """Yield all postures within limits that bring the tool to a pose, nearest to `near` first.

        Where a pose leaves wrist 3 free, it stays as in `near`.

        Raises:
            UsageError: a number is not finite.
        """
        if not (base_T_tool.is_finite() and all(map(math.isfinite, near))):
            raise UsageError("base_T_tool and near must be finite")
        form = self.form
        unit = Pose(base_T_tool.position, normalized(base_T_tool.quaternion))
        free = form.signs[5] * near[5] + form.offsets[5]
        try:
            postures = ur_postures(form.constants, self._shoulder_T_base @ unit @ self._tool_T_wrist_3, free)
        except UnreachableError:
            return
        within: list[Vector] = []
        for angles in postures:
            q = [
                nearest_turn(sign * (angle - offset), other, joint.lower, joint.upper)
                for sign, angle, offset, other, joint in zip(
                    form.signs, angles, form.offsets, near, self.chain.joints, strict=True
                )
            ]
            if None not in q:
                within.append(tuple(each for each in q if each is not None))
        yield from sorted(within, key=lambda each: travel(each, near, self.speed))

    def step_to(self, base_T_tool: Pose, near: Sequence[float]) -> Vector | None:
        """Return the posture for a pose close by, with no joint moved by more than `MAX_STEP`; None without one."""
        best = min(self.branches(base_T_tool, near), key=lambda each: largest_step(each, near), default=None)
        return best if best is not None and largest_step(best, near) <= MAX_STEP else None


def ur_form(chain: Chain) -> UrForm | None:
    """Return the form of a chain if it is that of Universal Robots' arms; None if it is another."""
    if len(chain.joints) != 6 or any(joint.is_prismatic for joint in chain.joints):
        return None
    axes = np.array([joint.axis for joint in chain.joints])
    points = np.array([joint.point for joint in chain.joints])
    cosines = np.abs(axes @ axes.T)
    are_parallel = min(cosines[1, 2], cosines[1, 3], cosines[2, 3]) > math.cos(_ANGLE)
    are_square = max(cosines[0, 1], cosines[3, 4], cosines[4, 5]) < _ANGLE
    if not (are_parallel and are_square):
        return None
    shoulder = _meeting(points[0], axes[0], points[1], axes[1])
    second = _meeting(points[3], axes[3], points[4], axes[4])
    third = _meeting(points[4], axes[4], points[5], axes[5])
    if shoulder is None or second is None or third is None:
        return None
    z = axes[0]
    # The arm's plane lies on the positive side of the pan axis: this chooses the direction of y.
    d4 = float((third - shoulder) @ axes[1])
    y = axes[1] if d4 > 0.0 else -axes[1]
    x = np.cross(y, z)
    in_plane = np.array((x, z))
    upper_arm, forearm = in_plane @ (points[2] - shoulder), in_plane @ (points[3] - points[2])
    a2, a3 = math.hypot(*upper_arm), math.hypot(*forearm)
    if min(abs(d4), a2, a3) < _MIN_OFFSET:
        return None
    # With a lift of 0 the upper arm lies along x; a larger one lowers it.
    lift = math.atan2(-upper_arm[1], upper_arm[0])
    elbow = math.atan2(-forearm[1], forearm[0]) - lift
    d5 = float(np.linalg.norm(third - second))
    hand = (third - second) / d5 if d5 > _LENGTH else axes[4]
    plane = math.atan2(hand @ x, hand @ z)
    # Seen along the hand, wrist 3 turns from y towards the back of x.
    back = -math.cos(plane) * x + math.sin(plane) * z
    wrist_2 = math.atan2(axes[5] @ back, axes[5] @ y)
    signs = (1.0, *(math.copysign(1.0, axes[k] @ y) for k in (1, 2, 3)), math.copysign(1.0, axes[4] @ hand), 1.0)
    offsets = (0.0, lift, elbow, plane - math.pi - lift - elbow, wrist_2, 0.0)
    base_T_shoulder = Pose((float(shoulder[0]), float(shoulder[1]), float(shoulder[2])), _quaternion(x, y, z))
    constants = UrConstants(
        d1=float(shoulder @ z),
        a2=a2,
        a3=a3,
        d4=abs(d4),
        d5=d5,
        d6=float((np.array(chain.base_T_tool.position) - third) @ axes[5]),
    )
    base = base_T_shoulder @ Pose((0.0, 0.0, -constants.d1))
    wrist_3 = ur_links(constants, base, offsets)["wrist_3_link"]
    return UrForm(constants, base_T_shoulder, wrist_3.relative(chain.base_T_tool), signs, offsets)


def _meeting(point: Array, axis: Array, other_point: Array, other_axis: Array) -> Array | None:
    """Return the point where two axes at right angles meet; None if they pass each other."""
    between = other_point - point
    # Seen along the other axis, its point lies `between` away; along the first axis, that leads to the foot.
    foot: Array = point + (between @ axis) * axis
    other_foot = other_point - (between @ other_axis) * other_axis
    return foot if float(np.linalg.norm(foot - other_foot)) < _LENGTH else None


def _quaternion(x: Array, y: Array, z: Array) -> Quaternion:
    """Return the quaternion of a frame with these axes (Bar-Itzhack: the eigenvector of the largest eigenvalue)."""
    (a, b, c), (d, e, f), (g, h, i) = np.column_stack((x, y, z))
    matrix = np.array(
        (
            (a + e + i, h - f, c - g, d - b),
            (h - f, a - e - i, b + d, c + g),
            (c - g, b + d, e - a - i, f + h),
            (d - b, c + g, f + h, i - a - e),
        )
    )
    w, qx, qy, qz = np.linalg.eigh(matrix)[1][:, -1]
    return (float(w), float(qx), float(qy), float(qz))
