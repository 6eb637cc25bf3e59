"""Tool paths: joint positions that carry the gripper along poses in the world, without a jump to another posture."""

import math
from collections.abc import Sequence

from cellwright.motion.joints import Joints, JointsLike
from cellwright.motion.kinematics import forward, inverse
from cellwright.motion.solver import MAX_STEP, largest_step
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose, Quaternion, normalized

SPACING = 0.01
"""Distance between neighbouring poses of a straight path [m]."""

TURN_SPACING = 0.05
"""Angle between neighbouring poses of a straight path [rad]."""


def straight(
    start: JointsLike,
    world_T_goal: Pose,
    *,
    rail: float | None = None,
    spacing: float = SPACING,
    max_step: float = MAX_STEP,
) -> tuple[Joints, ...]:
    """Return the joints along a straight path of the gripper from its present pose to another, with even rotation.

    Args:
        start: joints at the start.
        world_T_goal: pose of the gripper link at the end.
        rail: rail position at the end [m], approached in proportion; by default it stays.
        spacing: distance between neighbouring poses [m].
        max_step: maximum motion of a joint between neighbouring poses [rad; m].

    Raises:
        UnreachableError: a pose is out of reach, or a joint would have to jump or leave its range.
        UsageError: a number is not finite, or the spacing not positive.
    """
    if not spacing > 0.0:
        raise UsageError(f"spacing must be positive (got {spacing})")
    begin = Joints.of(start)
    world_T_start = forward(begin)
    goal_rail = begin.rail if rail is None else rail
    length = math.dist(world_T_start.position, world_T_goal.position)
    turn = angle_between(world_T_start, world_T_goal)
    reach = max(length / spacing, turn / TURN_SPACING, abs(goal_rail - begin.rail) / spacing)
    if not math.isfinite(reach):
        raise UsageError("world_T_goal, rail and spacing must be finite")
    count = max(1, math.ceil(reach - 1e-9))
    shares = [index / count for index in range(1, count + 1)]
    return follow(
        begin,
        [between(world_T_start, world_T_goal, share) for share in shares],
        [begin.rail + share * (goal_rail - begin.rail) for share in shares],
        max_step=max_step,
    )


def follow(
    start: JointsLike, world_T_grippers: Sequence[Pose], rails: float | Sequence[float], *, max_step: float = MAX_STEP
) -> tuple[Joints, ...]:
    """Return the joints along a sequence of gripper poses, in the posture that the arm is in.

    Args:
        start: joints before the first pose; the first of the result.
        world_T_grippers: poses of the gripper link, close to each other.
        rails: rail position at each pose [m], or one for all.
        max_step: maximum motion of a joint between neighbouring poses [rad; m].

    Raises:
        UnreachableError: a pose is out of reach, or a joint would have to jump or leave its range.
        UsageError: the numbers of rail positions and poses differ, or a number is not finite.
    """
    places = [float(rails)] * len(world_T_grippers) if isinstance(rails, float | int) else rails
    if len(places) != len(world_T_grippers):
        raise UsageError(
            f"rails and world_T_grippers must have the same length (got {len(places)} and {len(world_T_grippers)})"
        )
    path = [Joints.of(start)]
    for world_T_gripper, rail in zip(world_T_grippers, places, strict=True):
        last = path[-1]
        try:
            postures = inverse(world_T_gripper, rail, near=last)
        except UnreachableError as error:
            raise UnreachableError(f"the path leaves the arm's reach at {_place(world_T_gripper)}: {error}") from error
        best = min(postures, key=lambda joints: largest_step(joints, last))
        if (turn := largest_step(best, last)) > max_step:
            raise UnreachableError(
                f"a joint would jump by {turn:.2f} at {_place(world_T_gripper)}: "
                "the path passes a singularity or a joint limit"
            )
        path.append(best)
    return tuple(path)


def between(a: Pose, b: Pose, share: float) -> Pose:
    """Interpolate from a to b by a share: straight in position, evenly along the shorter rotation."""
    x, y, z = (p + share * (q - p) for p, q in zip(a.position, b.position, strict=True))
    return Pose((x, y, z), _slerp(a.quaternion, b.quaternion, share))


def angle_between(a: Pose, b: Pose) -> float:
    """Return the angle of the rotation between two poses [rad], from 0 to pi."""
    w, x, y, z = (a.inverse() @ b).quaternion
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


def _slerp(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """Spherical linear interpolation (Shoemake 1985)."""
    cosine = sum(p * q for p, q in zip(a, b, strict=True))
    sign = -1.0 if cosine < 0.0 else 1.0
    angle = math.acos(min(1.0, abs(cosine)))
    if math.sin(angle) < 1e-6:
        first, second = 1.0 - share, share * sign
    else:
        first = math.sin((1.0 - share) * angle) / math.sin(angle)
        second = sign * math.sin(share * angle) / math.sin(angle)
    w, x, y, z = (first * p + second * q for p, q in zip(a, b, strict=True))
    return normalized((w, x, y, z))


def _place(world_T_gripper: Pose) -> str:
    x, y, z = world_T_gripper.position
    return f"x {x:.3f}, y {y:.3f}, z {z:.3f} m"
