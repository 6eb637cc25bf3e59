"""The UR10 of 2017 on its rail, in closed form: its usual postures and ways.

Its frame is that of `cellwright.motion.arm_frame`: in 2017's cell the world. Other arms are `described_arm`.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from cellwright.clients.agents.kitter.postures import ArmFigures, Heights, Knots
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.layout.arms import Arm
from cellwright.config.ur10 import GRIPPER
from cellwright.config.ur10 import RAIL as BEAM
from cellwright.motion import JointMotion, Joints, arm_frame, forward, inverse, link_poses, move, solve
from cellwright.motion.solver import Vector
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose

RAIL_END = 2.1
"""Reach of the rail to either side [m]."""
SHOULDER_OFFSET = 0.163941
"""Distance [m] of the arm's plane beside its base (d4)."""
BASE_X = 0.3
"""x [m] of the arm's base in its frame."""
FOLDED = 0.38
"""Distance [m] of the tool in front of the base between stations."""
FOLDED_HEIGHT = 1.12
"""Height [m] of the tool then: what it holds clears the beam of the rail."""

OTHER_STATION = 0.8
"""Difference in pan [rad] from which two poses belong to different stations."""

RAIL_CHOICES = (0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3, 0.4, -0.4)
"""Distances [m] of the rail from the usual place that are tried when something is in the way."""

_PAN = 1
_ARM_LENGTH = 1.4
"""Distance [m] from the rail beyond which nothing is in reach."""
_USUAL = Joints(0.0, math.pi, -1.1, 1.5, 3.7, -math.pi / 2, 0.0)
_FIGURES = ArmFigures(
    joints=ARM_JOINTS,
    gripper=GRIPPER,
    is_soft=(False, *(True,) * 6),
    speed=(math.inf,) * 7,
    # about 5 cm of the tool
    steps=(0.05, 0.1, 0.06, 0.06, 0.15, 0.15, 0.3),
    home=_USUAL,
    carriers=frozenset({BEAM}),
    heights=Heights(travel=0.95, hover=0.9, waiting=1.0),
    drop_places=tuple(
        (x, y, math.copysign(rail, y))
        for y, rail in ((2.2, 1.5), (-2.2, 1.5), (1.2, 0.6), (-1.2, 0.6), (0.3, 0.2))
        for x in (-0.15, 0.75, -0.45, 1.05)
    ),
    belt_ends=(-1.7, 1.8),
)


class Ur10OnRail:
    """Postures of the UR10 on its rail.

    Args:
        arm: its entry in the layout.
    """

    def __init__(self, arm: Arm) -> None:
        self.world_T_frame = arm_frame(arm.pose)
        self.frame_T_base = self.world_T_frame.inverse() @ arm.pose
        self.figures = replace(
            _FIGURES,
            joints=tuple(arm.joint_prefix + name for name in ARM_JOINTS),
            gripper=arm.frame_prefix + GRIPPER,
            carriers=frozenset({arm.prefix + BEAM}),
        )

    def tool(self, q: Sequence[float]) -> Pose:
        """Return the pose of the tool."""
        return forward(Joints(*q))

    def rail_at(self, x: float, y: float) -> float:  # noqa: ARG002 - of the protocol
        """Return the rail's place nearest to a point [m], which may be beyond its end."""
        return y

    def rail_beside(self, x: float, y: float) -> float:
        """Return the rail's place [m], which may be beyond its end, from which the arm points straight at x, y [m]."""
        return y + SHOULDER_OFFSET if x < BASE_X else y - SHOULDER_OFFSET

    def rail_shift(self, dx: float, dy: float) -> float:  # noqa: ARG002 - of the protocol
        """Return by how much the rail's place changes for a point that moves [m]."""
        return dy

    def on_rail(self, rail: float) -> float:
        """Return the place on the rail [m] nearest to one that may be beyond its end."""
        return on_rail(rail)

    def rails(self, goal: Pose, rail: float) -> Iterable[float]:  # noqa: ARG002 - of the protocol
        """Return the rail's places worth trying [m], the usual one first."""
        return (on_rail(rail + aside) for aside in RAIL_CHOICES)

    def way_to(self, q: Sequence[float], x: float, y: float) -> tuple[float, float]:
        """Return a key that is smaller for a point nearer to where the arm stands: first the way of the rail counts."""
        return round(abs(y - q[0]), 1), abs(x - BASE_X)

    def reaches(self, goal: Pose, rail: float) -> bool:
        """Return whether it reaches a pose as usual, wherever it is now."""
        x, y, _ = goal.position
        if math.hypot(x - BASE_X, max(0.0, abs(y) - RAIL_END)) > _ARM_LENGTH:
            return False
        return station_posture(goal, rail, _USUAL) is not None

    def usual(self, goal: Pose, rail: float, present: Sequence[float]) -> Iterator[Vector]:
        """Yield the posture of all stations for a pose; none if it is out of reach."""
        posture = station_posture(goal, rail, present)
        if posture is not None:
            yield posture

    def again(self, goal: Pose, chosen: Vector, present: Sequence[float]) -> Vector | None:
        """Return the posture of all stations for a pose, with whole turns as near the present ones as can be."""
        return station_posture(goal, chosen[0], present)

    def sideways(self, goal: Pose, rail: float, present: Sequence[float]) -> Vector | None:
        """Return a posture for a pose with the cup facing sideways, the wrist above the hand; None if out of reach."""
        return side_posture(goal, rail, present)

    def step(self, goal: Pose, near: Sequence[float]) -> Vector | None:
        """Return the posture for a pose close by, with the rail where it is; None if it is out of reach."""
        return near_posture(goal, near[0], near)

    def ways(self, start: Sequence[float], goal: Vector, extra: float) -> Iterator[list[Vector]]:
        """Yield postures to stop at on the way between two: none at one station, else folded ones, ever higher."""
        if abs(goal[_PAN] - start[_PAN]) < OTHER_STATION:
            yield [goal]
        for higher in (0.0, 0.1, 0.2):
            yield [folded(start, start, extra + higher), folded(goal, start, extra + higher), goal]

    def rolled(self, q: Sequence[float], angle: float) -> Vector:
        """Return a posture with the tool turned by an angle [rad], or by its opposite within the range of the wrist."""
        *others, last = q
        sign = -1.0 if abs(last + angle) > abs(last - angle) else 1.0
        return (*others, last + sign * angle)

    def motion(self, start: Sequence[float], stops: Iterable[Sequence[float]]) -> Knots:
        """Return the shortest motion from one posture to others, with a rest at each."""
        motion = JointMotion.hold(Joints(*start), 0.0)
        for joints in stops:
            motion = motion.then(move(motion.end, Joints(*joints)))
        return Knots(motion.times, motion.positions, motion.velocities)


def station_posture(goal: Pose, rail: float, present: Sequence[float]) -> Joints | None:
    """Return joints for a tool pose in the posture of all stations; None if it is out of reach.

    The rail is at `rail` [m] or its end; of the whole turns, those nearest to the `present` joints are taken.
    """
    rail = on_rail(rail)
    pan = station_pan(goal.position[0], goal.position[1], rail)
    favoured = Joints(*present)._replace(shoulder_pan=pan)
    try:
        return solve(goal, favoured, rail=rail, accept=partial(faces_station, pan=pan))
    except UnreachableError:
        return None


def side_posture(goal: Pose, rail: float, present: Sequence[float]) -> Joints | None:
    """Return joints for a tool pose whose cup faces sideways, with the wrist above the hand; None if out of reach.

    The forearm comes from above then, and nothing of the arm is lower than the hand.
    """
    try:
        return solve(goal, Joints(*present), rail=on_rail(rail), accept=_is_wrist_above_hand)
    except UnreachableError:
        return None


def _is_wrist_above_hand(joints: Joints) -> bool:
    links = link_poses(joints)
    return links["wrist_1_link"].position[2] > links["wrist_3_link"].position[2] + 0.1


def near_posture(goal: Pose, rail: float, near: Sequence[float]) -> Joints | None:
    """Return joints for a tool pose with the rail at `rail` [m], nearest to others; None if it is out of reach."""
    try:
        return closest(inverse(goal, on_rail(rail), near=Joints(*near)), near)
    except UnreachableError:
        return None


def folded(joints: Sequence[float], present: Sequence[float], higher: float = 0.0) -> Vector:
    """Return the folded posture, in which the arm passes between the posts of the frame over the bins.

    Rail, pan and wrist 3 are as in `joints`; with a tall part on the cup the tool is kept `higher` than usual [m].
    """
    given = Joints(*joints)
    rail, pan = on_rail(given.rail), given.shoulder_pan
    cos, sin = math.cos(pan), math.sin(pan)
    x = BASE_X + FOLDED * cos - SHOULDER_OFFSET * sin
    y = rail + FOLDED * sin + SHOULDER_OFFSET * cos
    drawn_in = station_posture(Pose.from_rpy((x, y, FOLDED_HEIGHT + higher), (0.0, 0.0, pan)), rail, present)
    if drawn_in is None:
        return tuple(joints)
    return (given.rail, pan, *drawn_in[2:6], given.wrist_3)


def on_rail(place: float) -> float:
    """Return the place on the rail [m] nearest to one that may be beyond its end."""
    return max(-RAIL_END, min(RAIL_END, place))


def faces_station(joints: Joints, pan: float) -> bool:
    """Return whether the arm works a station as usual: its plane turned there by `pan` [rad], the hand forward."""
    return abs(joints.shoulder_pan - pan) < 0.3 and math.sin(joints.wrist_2) < 0.0


def closest(postures: Sequence[Joints], near: Sequence[float]) -> Joints:
    """Return the posture nearest to joint positions, wrist 3 and the rail disregarded."""
    place = near[1:6]
    return min(postures, key=lambda each: math.dist(each[1:6], place))


def station_pan(x: float, y: float, rail: float) -> float:
    """Return the pan [rad] that turns the arm's plane to a point, from -pi/4 to 7 pi/4."""
    dx, dy = x - BASE_X, y - rail
    distance = max(math.hypot(dx, dy), SHOULDER_OFFSET + 0.01)
    # The arm's plane passes the shoulder's axis at SHOULDER_OFFSET: a right triangle with this leg, and the distance as
    # hypotenuse, has the angle between the plane and the point.
    pan = math.atan2(dy, dx) - math.asin(SHOULDER_OFFSET / distance)
    return pan + 2 * math.pi if pan < -math.pi / 4 else pan
