"""Kinematics of the UR10 on its rail: forward, inverse in closed form, and the choice of one posture for a pose.

The chain is that of the arm's public robot description with the published Denavit-Hartenberg constants of the UR10.
`ur.py` has the formulas.
"""

import math
from collections.abc import Callable, Sequence

from cellwright.config.arm import RAIL_LIMIT
from cellwright.motion.joints import Joints, JointsLike, turned_near
from cellwright.motion.mounts import RailMount
from cellwright.motion.ur import TOUCHING, UrConstants, ur_links, ur_postures
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose, Vector3, normalized

BASE_X, BASE_Z = 0.3, 1.0
"""Position of `base_link` in the arm's frame [m]; its y is the rail's position."""

RAIL_HEIGHT = 0.9
"""Height of the rail's frame in the arm's frame [m]."""

LENGTHS = UrConstants(0.1273, 0.612, 0.5723, 0.163941, 0.1157, 0.0922, 0.220941, -0.1719)
"""Lengths of the arm, a UR10, as its maker publishes them; the offsets are those of the robot description of ROS 1."""

FACE_DEPTH = 0.005
"""Depth of the cup's face below the gripper's origin, along its -z [m]."""

_WRIST_3_T_GRIPPER = Pose.from_rpy((0.0, 0.1, 0.0), (90 * 0.0174533, 0.0, 0.0))
_GRIPPER_T_WRIST_3 = _WRIST_3_T_GRIPPER.inverse()
_GRIPPER_T_FACE = Pose((0.0, 0.0, -FACE_DEPTH))

WEIGHTS = Joints(1.5, 1.0, 1.0, 0.8, 0.5, 0.5, 0.3)
"""Cost of moving each joint [per m for the rail; per rad]: the more of the arm it carries, the higher."""
COMFORTABLE = (0.45, 1.0)
"""Horizontal distances [m] of the gripper from the pan axis at which the arm is neither folded up nor stretched."""
DISCOMFORT = 10.0
"""Cost of distances outside of them [per m]."""
_RAIL = RailMount(Pose((BASE_X, 0.0, BASE_Z)), (0.0, 1.0, 0.0), -RAIL_LIMIT, RAIL_LIMIT, COMFORTABLE)


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
    base = Pose((BASE_X, q.rail, BASE_Z))
    links = ur_links(LENGTHS, base, q[1:])
    return {"base_link": base, **links, "vacuum_gripper_link": links["wrist_3_link"] @ _WRIST_3_T_GRIPPER}


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
    if abs(rail) > RAIL_LIMIT + TOUCHING:
        raise UnreachableError(f"the rail must be within ±{RAIL_LIMIT} m (got {rail:.3f} m)")
    favoured = None if near is None else Joints.of(near)
    unit = Pose(world_T_gripper.position, normalized(world_T_gripper.quaternion))
    shoulder_T_wrist_3 = Pose((BASE_X, rail, BASE_Z + LENGTHS.d1)).inverse() @ unit @ _GRIPPER_T_WRIST_3
    if favoured is None:
        return tuple([Joints(rail, *angles) for angles in ur_postures(LENGTHS, shoulder_T_wrist_3, rail=rail)])
    postures = ur_postures(LENGTHS, shoulder_T_wrist_3, favoured.wrist_3, rail=rail)
    near_angles = favoured[1:]
    return tuple([Joints(rail, *turned_near(angles, near_angles)) for angles in postures])


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
    elbow_out, elbow_up = LENGTHS.a2 * math.cos(joints.shoulder_lift), -LENGTHS.a2 * math.sin(joints.shoulder_lift)
    wrist_out, wrist_up = elbow_out + LENGTHS.a3 * math.cos(lower), elbow_up - LENGTHS.a3 * math.sin(lower)
    return wrist_out > 0.0 and elbow_up * wrist_out > wrist_up * elbow_out


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
    return _RAIL.positions(world_T_gripper, present)
