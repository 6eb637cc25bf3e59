"""Kinematics of the UR10 on its rail: forward, inverse in closed form, and the choice of one posture for a pose.

The chain is that of the arm's public robot description with the published Denavit-Hartenberg constants of the UR10.
In the frames of that description joints 2, 3 and 4 turn about parallel y axes. So the arm lies in a vertical plane,
which is offset from the pan axis by d4. The inverse follows in three parts, each with two solutions:

- the plane, from the position of the wrist (over the left or the right shoulder);
- the wrist, from the Y-Z-Y Euler angles of the hand in that plane;
- the triangle of upper arm and forearm (elbow up or down).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

from cellwright.config.arm import RAIL_LIMIT
from cellwright.motion.joints import Joints, JointsLike
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose, Quaternion, Vector3, normalized, rotate

BASE_X, BASE_Z = 0.3, 1.0
"""Position of `base_link` in the arm's frame [m]; its y is the rail's position."""

RAIL_HEIGHT = 0.9
"""Height of the rail's frame in the arm's frame [m]."""

D1, A2, A3, D4, D5 = 0.1273, 0.612, 0.5723, 0.163941, 0.1157
"""Denavit-Hartenberg constants of the UR10 [m], as positive lengths."""

SHOULDER_OFFSET, ELBOW_OFFSET = 0.220941, -0.1719
"""Offsets of the upper arm from the pan axis, and of the forearm from the upper arm, along their y [m]."""

FACE_DEPTH = 0.005
"""Depth of the cup's face below the gripper's origin, along its -z [m]."""

MAX_REACH = A2 + A3
"""Maximum distance of the axis of wrist 1 from that of the shoulder [m]."""

_WRIST_3_T_GRIPPER = Pose.from_rpy((0.0, 0.1, 0.0), (90 * 0.0174533, 0.0, 0.0))
_GRIPPER_T_WRIST_3 = _WRIST_3_T_GRIPPER.inverse()
_GRIPPER_T_FACE = Pose((0.0, 0.0, -FACE_DEPTH))

_SINGULAR = 1e-10
"""Sine of wrist 2 below which its neighbours turn about one axis, so that wrist 3 is a free choice."""

_TOUCHING = 1e-7
"""Distance [m] by which a target may be out of reach and still count as at its edge: the effect of rounding where
two singularities meet."""

_SAME = 1e-7
"""Difference [rad] below which solutions are one: at a fold, square roots amplify rounding no further."""

Rows: TypeAlias = tuple[Vector3, Vector3, Vector3]

WEIGHTS = Joints(1.5, 1.0, 1.0, 0.8, 0.5, 0.5, 0.3)
"""Cost of moving each joint [per m for the rail; per rad]: the more of the arm it carries, the higher."""
COMFORTABLE = (0.45, 1.0)
"""Horizontal distances [m] of the gripper from the pan axis at which the arm is neither folded up nor stretched."""
DISCOMFORT = 10.0
"""Cost of distances outside of them [per m]."""
_RAIL_STEP = 0.1


def arm_frame(rail: Pose) -> Pose:
    """Return the pose in the world of the arm's frame, which is the world of all other functions, by that of the rail.

    In 2017's cell the two are the same. Elsewhere `arm_frame(rail).inverse()` brings poses of the world into the arm's
    frame.

    Args:
        rail: pose of the rail's frame in the world [m], as that of an arm of a `Layout`.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> arm_frame(gear2017().arms[0].pose) == Pose()
        True
    """
    return rail @ Pose((BASE_X, 0.0, RAIL_HEIGHT)).inverse()


def forward(joints: JointsLike) -> Pose:
    """Return the pose `world_T_gripper` of the gripper link [m]; limits are ignored."""
    return link_poses(joints)["vacuum_gripper_link"]


def link_poses(joints: JointsLike) -> dict[str, Pose]:
    """Return the poses in the world of the links that the joints move, by the names of the robot description."""
    q = Joints.of(joints)
    quarter = math.pi / 2
    base = Pose((BASE_X, q.rail, BASE_Z))
    shoulder = base @ Pose((0.0, 0.0, D1), _about_z(q.shoulder_pan))
    upper_arm = shoulder @ Pose((0.0, SHOULDER_OFFSET, 0.0), _about_y(quarter + q.shoulder_lift))
    forearm = upper_arm @ Pose((0.0, ELBOW_OFFSET, A2), _about_y(q.elbow))
    wrist_1 = forearm @ Pose((0.0, 0.0, A3), _about_y(quarter + q.wrist_1))
    wrist_2 = wrist_1 @ Pose((0.0, D4 - SHOULDER_OFFSET - ELBOW_OFFSET, 0.0), _about_z(q.wrist_2))
    wrist_3 = wrist_2 @ Pose((0.0, 0.0, D5), _about_y(q.wrist_3))
    return {
        "base_link": base,
        "shoulder_link": shoulder,
        "upper_arm_link": upper_arm,
        "forearm_link": forearm,
        "wrist_1_link": wrist_1,
        "wrist_2_link": wrist_2,
        "wrist_3_link": wrist_3,
        "vacuum_gripper_link": wrist_3 @ _WRIST_3_T_GRIPPER,
    }


def inverse(world_T_gripper: Pose, rail: float, *, near: JointsLike | None = None) -> tuple[Joints, ...]:
    """Return all postures, up to eight, that bring the gripper link to a pose with the rail at `rail` [m].

    Args:
        world_T_gripper: the pose [m].
        rail: position of the rail [m].
        near: reference posture. Whole turns are added to each angle, within limits, to be nearest to it; without it,
            angles are from -pi to pi. `Joints.turned` lists all choices. It also sets wrist 3 if the pose leaves it
            free.

    Returns:
        Distinct postures. Where solutions meet (arm stretched out, wrist 2 at 0 or pi, wrist beside the pan axis) there
        are fewer than eight. Where wrist 2 is at 0 or pi, wrists 1 and 3 turn about one axis, and infinitely many
        postures are solutions. The one with wrist 3 as in `near` (or at 0) represents them.

    Raises:
        UnreachableError: there is no posture; the text says why.
        UsageError: a number is not finite.
    """
    if not world_T_gripper.is_finite() or not math.isfinite(rail):
        raise UsageError("world_T_gripper and rail must be finite")
    if abs(rail) > RAIL_LIMIT + _TOUCHING:
        raise UnreachableError(f"the rail must be within ±{RAIL_LIMIT} m (got {rail:.3f} m)")
    favoured = None if near is None else Joints.of(near)
    unit = Pose(world_T_gripper.position, normalized(world_T_gripper.quaternion))
    shoulder_T_wrist_3 = Pose((BASE_X, rail, BASE_Z + D1)).inverse() @ unit @ _GRIPPER_T_WRIST_3
    rows = _rows(shoulder_T_wrist_3.quaternion)
    found: list[Joints] = []
    min_excess = math.inf
    for pan in _pan_angles(shoulder_T_wrist_3.position):
        outward = shoulder_T_wrist_3.position[0] * math.cos(pan) + shoulder_T_wrist_3.position[1] * math.sin(pan)
        up = shoulder_T_wrist_3.position[2]
        for plane, wrist_2, wrist_3_angle in _wrist_solutions(
            _turned_back(pan, rows), outward, up, favoured.wrist_3 if favoured else 0.0
        ):
            # Wrist 1 is d5 behind the origin of wrist 3, along the hand's direction in the plane.
            x, z = outward - D5 * math.sin(plane), up - D5 * math.cos(plane)
            distance = math.hypot(x, z)
            excess = max(distance - MAX_REACH, (A2 - A3) - distance)
            if excess > _TOUCHING:
                min_excess = min(min_excess, excess)
                continue
            # The triangle of upper arm a2, forearm a3 and the line r from shoulder to wrist 1: by the law of cosines
            # r^2 = a2^2 + a3^2 + 2 a2 a3 cos(elbow). Elbow up and elbow down are mirror images about that line.
            bend = math.acos(max(-1.0, min(1.0, (distance**2 - A2**2 - A3**2) / (2 * A2 * A3))))
            for elbow in (bend, -bend):
                # A larger lift lowers the upper arm, hence -z; the second term is the angle from r to the upper arm.
                # The angles of the three parallel joints sum up to the plane angle, half a turn apart at zero.
                lift = math.atan2(-z, x) - math.atan2(A3 * math.sin(elbow), A2 + A3 * math.cos(elbow))
                angles = (pan, lift, elbow, plane - math.pi - lift - elbow, wrist_2, wrist_3_angle)
                joints = Joints(rail, *map(_principal, angles))
                if not any(_is_same(joints, other) for other in found):
                    found.append(joints)
    if not found:
        raise UnreachableError(f"the wrist is {min_excess * 1000:.1f} mm out of reach with the rail at {rail:.3f} m")
    return tuple(found if favoured is None else (joints.nearest(favoured) for joints in found))


def tool_down(x: float, y: float, z: float, yaw: float = 0.0) -> Pose:
    """Return the pose `world_T_gripper` with the cup pointing straight down and the middle of its face at x, y, z [m].

    `yaw` is that of the gripper link's x axis in the world [rad].
    """
    return Pose.from_rpy((x, y, z + FACE_DEPTH), (0.0, 0.0, yaw))


def face(world_T_gripper: Pose) -> Vector3:
    """Return the position of the middle of the cup's face in the world [m]."""
    return (world_T_gripper @ _GRIPPER_T_FACE).position


def is_usual(joints: Joints) -> bool:
    """Return whether the arm reaches forward, not over its back, with its elbow up, away from bins, belt and trays.

    Forward: wrist 1 is on the side of the shoulder that the pan axis turns to the tool. Up: the elbow is above the
    straight line from the shoulder to wrist 1.
    """
    lower = joints.shoulder_lift + joints.elbow
    elbow_out, elbow_up = A2 * math.cos(joints.shoulder_lift), -A2 * math.sin(joints.shoulder_lift)
    wrist_out, wrist_up = elbow_out + A3 * math.cos(lower), elbow_up - A3 * math.sin(lower)
    return wrist_out > 0.0 and elbow_up * wrist_out > wrist_up * elbow_out


def _pan_angles(wrist_3: Vector3) -> tuple[float, ...]:
    """Return the pan angles [rad] for which the arm's plane, d4 off the pan axis, contains the origin of wrist 3."""
    distance = math.hypot(wrist_3[0], wrist_3[1])
    if distance < D4 - _TOUCHING:
        raise UnreachableError(
            f"wrist 3 must be at least {D4:.3f} m from the pan axis (got {distance:.3f} m); move the rail"
        )
    # Seen from above, the arm's plane is a line at the distance d4 from the pan axis, and wrist 3 a point on it: so
    # sin(direction - pan) = d4 / distance. The arm over its other shoulder is the second solution of the sine.
    direction = math.atan2(wrist_3[1], wrist_3[0])
    aside = math.asin(min(1.0, D4 / distance))
    return direction - aside, direction + aside - math.pi


def _wrist_solutions(
    pan_R_wrist_3: Rows, outward: float, up: float, free_wrist_3: float
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
        planes = (_plane_in_reach(outward, up, math.atan2(m02, m00) - free_wrist_3),)
    else:
        # ... or by their difference, with half a turn about z
        planes = (_plane_in_reach(outward, up, math.atan2(m02, -m00) + free_wrist_3),)
    for plane in planes:
        c, s = math.cos(plane), math.sin(plane)
        # Without the first turn, Rz(wrist 2) Ry(wrist 3) remains. Reading both from it, and not from the
        # matrix, keeps their sum exact where each alone is ill defined.
        yield plane, math.atan2(-(c * m01 - s * m21), m11), math.atan2(-(s * m00 + c * m20), s * m02 + c * m22)


def _plane_in_reach(outward: float, up: float, target: float) -> float:
    """Return the plane angle [rad] nearest to the target with wrist 1 in reach, or the target if there is none."""
    distance = math.hypot(outward, up)
    direction = math.atan2(outward, up)
    to_wrist_1 = math.hypot(outward - D5 * math.sin(target), up - D5 * math.cos(target))
    limit = min(MAX_REACH, max(A2 - A3, to_wrist_1))
    if limit == to_wrist_1 or distance == 0.0:
        return target
    # Wrist 1 is d5 from the origin of wrist 3, in the direction of the plane angle: the law of cosines.
    aside = math.acos(max(-1.0, min(1.0, (distance**2 + D5**2 - limit**2) / (2 * distance * D5))))
    return min((direction + aside, direction - aside), key=lambda angle: abs(_principal(angle - target)))


def _turned_back(pan: float, rows: Rows) -> Rows:
    """Return Rz(-pan) times the matrix."""
    c, s = math.cos(pan), math.sin(pan)
    (a, b, d), (e, f, g), last = rows
    return (c * a + s * e, c * b + s * f, c * d + s * g), (c * e - s * a, c * f - s * b, c * g - s * d), last


def _rows(q: Quaternion) -> Rows:
    """Return the rotation matrix of a unit quaternion."""
    x, y, z = rotate(q, (1.0, 0.0, 0.0)), rotate(q, (0.0, 1.0, 0.0)), rotate(q, (0.0, 0.0, 1.0))
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def _about_y(angle: float) -> Quaternion:
    return (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)


def _about_z(angle: float) -> Quaternion:
    return (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))


def _principal(angle: float) -> float:
    """Return the same angle [rad] from -pi to pi."""
    return math.remainder(angle, 2.0 * math.pi)


def _is_same(a: Joints, b: Joints) -> bool:
    return all(abs(_principal(mine - other)) < _SAME for mine, other in zip(a[1:], b[1:], strict=True))


def solve(
    world_T_gripper: Pose,
    near: JointsLike,
    *,
    rail: float | Sequence[float] | None = None,
    usual: bool = True,
    accept: Callable[[Joints], bool] | None = None,
) -> Joints:
    """Return the comfortable posture that brings the gripper to a pose at the least cost of motion.

    The cost of a posture has two terms. One is the weighted distance from `near`: the root of the sum of the squares of
    `WEIGHTS` times each joint's distance. The other is `DISCOMFORT` times the distance [m] of the gripper from the
    `COMFORTABLE` ring about the pan axis. Whole turns are chosen, within limits, to be nearest to `near`.

    Args:
        world_T_gripper: target pose of the gripper link [m].
        near: present or preferred posture.
        rail: allowed rail positions [m]; any by default.
        usual: allow only postures that reach forward, not over the arm's back, with the elbow up (`is_usual`).
        accept: allow only postures for which it returns True.

    Raises:
        UnreachableError: no posture qualifies; the text gives the reason at the most comfortable place.
        UsageError: a number is not finite.
    """
    start = Joints.of(near)
    if rail is None:
        rail = rail_candidates(world_T_gripper, start.rail)
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
        # The penalty depends on the place alone, so all postures there share it.
        penalty = DISCOMFORT * discomfort(world_T_gripper, place)
        for joints in postures:
            if usual and not is_usual(joints):
                reasons.setdefault(place, f"with the rail at {place:.3f} m only elbow down or over its back")
                continue
            cost = distance(joints, start) + penalty
            if cost >= best_cost:
                continue
            if accept is not None and not accept(joints):
                reasons[place] = f"with the rail at {place:.3f} m only in postures that `accept` refuses"
                continue
            best, best_cost = joints, cost
    if best is None:
        x, y, z = world_T_gripper.position
        why = "no rail position was given"
        if places:
            why = reasons[min(places, key=lambda place: discomfort(world_T_gripper, place))]
        raise UnreachableError(f"the gripper cannot reach x {x:.3f}, y {y:.3f}, z {z:.3f} m: {why}")
    return best


def distance(a: Joints, b: Joints) -> float:
    """Return the weighted distance between two postures, turn by turn: pi and -pi are far apart."""
    return math.sqrt(sum((w * (p - q)) ** 2 for p, q, w in zip(a, b, WEIGHTS, strict=True)))


def discomfort(world_T_gripper: Pose, rail: float) -> float:
    """Return the gripper's distance [m] from the `COMFORTABLE` ring about the pan axis, with the rail at `rail` [m]."""
    x, y, _ = world_T_gripper.position
    radius = math.hypot(x - BASE_X, y - rail)
    return max(0.0, COMFORTABLE[0] - radius, radius - COMFORTABLE[1])


def rail_candidates(world_T_gripper: Pose, present: float) -> tuple[float, ...]:
    """Return rail positions [m] worth trying, those near the present one first.

    They are the present one, the edges of the comfortable stretches, and every 0.1 m of the rail.
    """
    x, y, _ = world_T_gripper.position
    places = {present, y}
    for radius in COMFORTABLE:
        if radius > abs(x - BASE_X):
            # Rail positions from which the gripper lies on a circle about the pan axis: two, ahead of it and behind.
            along = math.sqrt(radius**2 - (x - BASE_X) ** 2)
            places |= {y - along, y + along}
    steps = round(2 * RAIL_LIMIT / _RAIL_STEP)
    places |= {-RAIL_LIMIT + 2 * RAIL_LIMIT * step / steps for step in range(steps + 1)}
    inside = {max(-RAIL_LIMIT, min(RAIL_LIMIT, place)) for place in places}
    return tuple(sorted(inside, key=lambda place: (abs(place - present), place)))
