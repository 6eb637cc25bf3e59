"""Choosing one posture for a pose: where to put the rail, which of the solutions, and which whole turns."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from cellwright.config.layout import RAIL_LIMIT
from cellwright.motion.joints import Joints, JointsLike
from cellwright.motion.ur import BASE_X, inverse, is_usual
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose

WEIGHTS = Joints(1.5, 1.0, 1.0, 0.8, 0.5, 0.5, 0.3)
"""What moving each joint costs [per m for the rail; per rad]: the more, the more of the arm it carries."""

COMFORTABLE = (0.45, 1.0)
"""Horizontal distances [m] of the gripper from the pan axis at which the arm is neither folded up nor stretched."""

DISCOMFORT = 10.0
"""What it costs to be outside of them [per m]."""

_RAIL_STEP = 0.1


def solve(
    world_T_gripper: Pose,
    near: JointsLike,
    *,
    rail: float | Sequence[float] | None = None,
    usual: bool = True,
    accept: Callable[[Joints], bool] | None = None,
) -> Joints:
    """The posture that brings the gripper to a pose at the least cost of moving there, and stands comfortably.

    The cost of a posture is the root of the sum of the squares of `WEIGHTS` times the distance of each joint from
    `near`, and `DISCOMFORT` times the distance [m] by which the gripper is outside of the `COMFORTABLE` ring about
    the pan axis. Whole turns are chosen, within limits, to be nearest to `near`.

    Args:
        world_T_gripper: where the gripper link is to be [m].
        near: where the arm is, or where it should stay near to.
        rail: where the rail may be [m]; when left out, anywhere.
        usual: only postures that reach forward, not over the arm's back, with the elbow up (`is_usual`).
        accept: further wishes; only postures for which it returns True are taken.

    Raises:
        UnreachableError: no posture serves, and why not from the most comfortable place.
        UsageError: a number is not finite.
    """
    start = Joints.of(near)
    if rail is None:
        places: Sequence[float] = rail_candidates(world_T_gripper, start.rail)
    else:
        places = (rail,) if isinstance(rail, float | int) else tuple(rail)
    best: Joints | None = None
    best_cost = math.inf
    reasons: dict[float, str] = {}
    for place in places:
        try:
            postures = inverse(world_T_gripper, place, near=start)
        except UnreachableError as error:
            reasons[place] = str(error)
            continue
        penalty = DISCOMFORT * discomfort(world_T_gripper, place)
        for joints in postures:
            if usual and not is_usual(joints):
                reasons.setdefault(place, f"with the rail at {place:.3f} m only elbow down or over its back")
                continue
            cost = distance(joints, start) + penalty
            if cost >= best_cost:
                continue
            if accept is not None and not accept(joints):
                reasons[place] = f"with the rail at {place:.3f} m only in postures that are not accepted"
                continue
            best, best_cost = joints, cost
    if best is None:
        x, y, z = world_T_gripper.position
        why = "no place for the rail was given"
        if places:
            why = reasons[min(places, key=lambda place: discomfort(world_T_gripper, place))]
        raise UnreachableError(f"the arm does not bring its gripper to x {x:.3f}, y {y:.3f}, z {z:.3f} m: {why}")
    return best


def distance(a: Joints, b: Joints, weights: Joints = WEIGHTS) -> float:
    """The weighted distance between two postures, turn by turn: pi and -pi are far apart."""
    return math.sqrt(sum((w * (p - q)) ** 2 for p, q, w in zip(a, b, weights, strict=True)))


def discomfort(world_T_gripper: Pose, rail: float) -> float:
    """How far [m] the gripper is outside of the `COMFORTABLE` ring about the pan axis with the rail at `rail` [m]."""
    x, y, _ = world_T_gripper.position
    radius = math.hypot(x - BASE_X, y - rail)
    return max(0.0, COMFORTABLE[0] - radius, radius - COMFORTABLE[1])


def rail_candidates(world_T_gripper: Pose, present: float) -> tuple[float, ...]:
    """Rail positions [m] worth trying, those near the present one first.

    The present one, the edges of the comfortable stretches, and every 0.1 m of the rail.
    """
    x, y, _ = world_T_gripper.position
    places = {present, y}
    for radius in COMFORTABLE:
        if radius > abs(x - BASE_X):
            along = math.sqrt(radius**2 - (x - BASE_X) ** 2)
            places |= {y - along, y + along}
    steps = round(2 * RAIL_LIMIT / _RAIL_STEP)
    places |= {-RAIL_LIMIT + 2 * RAIL_LIMIT * step / steps for step in range(steps + 1)}
    inside = {max(-RAIL_LIMIT, min(RAIL_LIMIT, place)) for place in places}
    return tuple(sorted(inside, key=lambda place: (abs(place - present), place)))
