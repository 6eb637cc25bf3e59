"""Any arm that the cell describes, by a solver: its usual postures and the ways between them.

Its frame is the world. A posture is usual if the arm comes from above: what is behind its third joint, up to the wrist,
is higher than the tool. So a rule on heights of links stands for "elbow up", whatever the angles mean.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, product

from cellwright.clients.agents.kitter.clearance import places_along
from cellwright.clients.agents.kitter.postures import ArmFigures, Heights, Knots
from cellwright.config.layout.arms import Arm
from cellwright.config.ur10 import GRIPPER
from cellwright.mechanism.solvers import solver_of
from cellwright.motion.chain import Chain, ChainLink
from cellwright.motion.mounts import FixedMount, RailMount
from cellwright.motion.solver import Vector
from cellwright.util.pose import Pose

ABOVE = 0.05
"""Least height [m] of elbow and wrist over the tool in a usual posture."""

MIN_SINGULAR = 0.01
"""Smallest singular value of a usual posture [m]: there a joint turns at 10 rad/s at most for a tool at 0.1 m/s."""

ACCELERATION = 4.0
"""Largest acceleration of a joint from posture to posture [rad/s^2; m/s^2]: descriptions name none."""

SPEED_SHARE = 0.7
"""Share of its maximum speed at which a joint moves."""

TRAVEL, HOVER, WAITING = 0.19, 0.14, 0.19
"""Distances [m] of the heights from the highest surface of the cell."""

DRAWN_IN, LIFTED = 0.3, 0.1
"""Distance of the tool from the base on ways around, as a share of the arm's length, and its extra height [m]."""

HIGHER = (0.0, 0.1, 0.2)
"""More extra heights [m] that are tried there."""

COMFORTABLE = (0.2, 0.45)
"""Distances of the tool from the pan axis at which a rail's place is tried, as shares of the arm's length."""

DROP_REACHES, DROP_DIRECTIONS = (0.4, 0.35, 0.45, 0.3), 12
"""Distances from the base at which parts are dropped, as shares of the arm's length, and the number of directions."""

DIP = 0.03
"""Distance [m] by which the tool may be lower on a way than at its lower end."""

STEP = 0.05
"""Largest motion [m] of the tool between two places of a path that are looked at."""


class DescribedArm:
    """Postures of an arm, by its description.

    Args:
        chain: the arm, from the frame of its mount to its cup, as `Client.chains` returns it.
        arm: its entry in the layout.
        home: the posture in which it began [rad; m].
        highest: height of the highest surface of bins, belts and trays [m].
    """

    world_T_frame = Pose()

    def __init__(self, chain: Chain, arm: Arm, home: Sequence[float], highest: float) -> None:
        mount = arm.mount
        self.chain = chain
        self.frame_T_base = mount.pose
        self._rails = 1 if mount.kind == "rail" else 0
        moving = behind(chain) if self._rails else chain
        self._solver = solver_of(moving, home[self._rails :])
        self._reach = moving.reach
        self._axis = chain.joints[0].axis if self._rails else (0.0, 0.0, 0.0)
        first = chain.joints[0]
        near, far = COMFORTABLE
        self._mount: RailMount | FixedMount = (
            RailMount(mount.pose, first.axis, first.lower, first.upper, (near * self._reach, far * self._reach))
            if self._rails
            else FixedMount(mount.pose)
        )
        self._above = [
            name for name, link in moving.links.items() if 3 <= link.joints <= max(3, len(moving.joints) - 2)
        ]
        bodies = (arm.prefix + name.removeprefix(arm.frame_prefix) for name in chain.links)
        self.figures = ArmFigures(
            joints=tuple(joint.name for joint in chain.joints),
            gripper=arm.frame_prefix + GRIPPER,
            is_soft=tuple(not joint.is_prismatic for joint in chain.joints),
            speed=tuple(SPEED_SHARE * joint.speed for joint in chain.joints),
            steps=_steps(chain),
            home=tuple(home),
            carriers=frozenset({f"{arm.name}_{mount.kind}", *bodies}),
            heights=Heights(highest + TRAVEL, highest + HOVER, highest + WAITING),
            drop_places=(),
        )
        self.figures = replace(self.figures, drop_places=tuple(self._drop_places()))

    def tool(self, q: Sequence[float]) -> Pose:
        """Return the pose of the tool."""
        return self.frame_T_base @ self.chain.tool(q)

    def rail_at(self, x: float, y: float) -> float:
        """Return the rail's place nearest to a point [m], which may be beyond its end."""
        at = self.frame_T_base.inverse().transform((x, y, 0.0))
        return self._axis[0] * at[0] + self._axis[1] * at[1]

    def rail_beside(self, x: float, y: float) -> float:
        """Return the rail's usual place for work at a point [m], which may be beyond its end."""
        return self.rail_at(x, y)

    def rail_shift(self, dx: float, dy: float) -> float:
        """Return by how much the rail's place changes for a point that moves [m]."""
        return self.rail_at(dx, dy) - self.rail_at(0.0, 0.0)

    def on_rail(self, rail: float) -> float:
        """Return the place on the rail [m] nearest to one that may be beyond its end."""
        first = self.chain.joints[0]
        return max(first.lower, min(first.upper, rail)) if self._rails else 0.0

    def rails(self, goal: Pose, rail: float) -> Iterable[float]:
        """Return the rail's places worth trying for a pose [m], the usual one first."""
        return (place.position for place in self._mount.places(goal, self.on_rail(rail)))

    def way_to(self, q: Sequence[float], x: float, y: float) -> tuple[float, float]:
        """Return a key that is smaller for a point nearer to where the arm stands."""
        place = q[0] if self._rails else 0.0
        bx, by, _ = self._base(place).position
        return round(abs(self.rail_at(x, y) - place), 1), math.hypot(x - bx, y - by)

    def reaches(self, goal: Pose, rail: float) -> bool:
        """Return whether it reaches a pose as usual, wherever it is now."""
        return next(self._from_above(goal, self.on_rail(rail), self.figures.home), None) is not None

    def usual(self, goal: Pose, rail: float, present: Sequence[float]) -> Iterator[Vector]:
        """Yield usual postures for a pose to which there is a way from the present one, the nearest first."""
        for posture in self._from_above(goal, self.on_rail(rail), present):
            if next(self.ways(present, posture, 0.0), None) is not None:
                yield posture

    def again(self, goal: Pose, chosen: Vector, present: Sequence[float]) -> Vector | None:  # noqa: ARG002 - of the protocol
        """Return the posture that was chosen: another branch might have something in its way."""
        return chosen

    def sideways(self, goal: Pose, rail: float, present: Sequence[float]) -> Vector | None:
        """Return a posture for a pose with the cup facing sideways, the arm above the hand; None if out of reach."""
        return next(self._from_above(goal, self.on_rail(rail), present), None)

    def step(self, goal: Pose, near: Sequence[float]) -> Vector | None:
        """Return the posture for a pose close by, with the rail where it is; None if it is out of reach."""
        place = near[: self._rails]
        base = self._base(place[0] if place else 0.0)
        q = self._solver.step_to(base.inverse() @ goal, near[self._rails :])
        return None if q is None else (*place, *q)

    def ways(self, start: Sequence[float], goal: Vector, extra: float) -> Iterator[list[Vector]]:
        """Yield postures to stop at on the way between two: none, else with the tool drawn in, ever higher."""
        if self._keeps_height([start, goal]):
            yield [goal]
        for higher in HIGHER:
            stops = [self._drawn_in(start, extra + higher), self._drawn_in(goal, extra + higher)]
            drawn = [each for each in stops if each is not None]
            if len(drawn) == len(stops) and self._keeps_height([start, *drawn, goal]):
                yield [*drawn, goal]

    def rolled(self, q: Sequence[float], angle: float) -> Vector:
        """Return a posture with the tool turned about its axis by an angle [rad], or by its opposite, within limits."""
        *others, last = q
        wrist = self.chain.joints[-1]
        middle = (max(wrist.lower, -2 * math.pi) + min(wrist.upper, 2 * math.pi)) / 2
        sign = -1.0 if abs(last + angle - middle) > abs(last - angle - middle) else 1.0
        return (*others, last + sign * angle)

    def motion(self, start: Sequence[float], stops: Iterable[Sequence[float]]) -> Knots:
        """Return the motion from one posture to others, with a rest at each: cubics of time, as in the controller."""
        positions = [tuple(start), *(tuple(stop) for stop in stops)]
        times = [0.0]
        for one, other in pairwise(positions):
            # a cubic from rest to rest has 1.5 times its mean speed, and accelerates by 6 times the way over the
            # square of the time
            needed = (
                max(1.5 * abs(b - a) / speed, math.sqrt(6.0 * abs(b - a) / ACCELERATION))
                for a, b, speed in zip(one, other, self.figures.speed, strict=True)
            )
            times.append(times[-1] + max(0.02, *needed))
        return Knots(times, positions, [(0.0,) * len(start)] * len(positions))

    def _base(self, rail: float) -> Pose:
        x, y, z = self._axis
        return self.frame_T_base @ Pose((rail * x, rail * y, rail * z))

    def _from_above(self, goal: Pose, place: float, near: Sequence[float]) -> Iterator[Vector]:
        """Yield usual postures for a pose, the nearest to another posture first."""
        for q in self._solver.branches(self._base(place).inverse() @ goal, near[self._rails :]):
            if self._is_usual(q):
                yield (*(place,) * self._rails, *q)

    def _is_usual(self, q: Vector) -> bool:
        links = self._solver.links(q)
        lowest = links[self.figures.gripper].position[2] + ABOVE
        return (
            all(links[name].position[2] >= lowest for name in self._above)
            and self._solver.margin(q).singular > MIN_SINGULAR
        )

    def _drawn_in(self, q: Sequence[float], extra: float) -> Vector | None:
        """Return a posture with the tool nearer to the base, in the same direction and higher; None if out of reach."""
        tool, place = self.tool(q), q[0] if self._rails else 0.0
        bx, by, _ = self._base(place).position
        direction = math.atan2(tool.position[1] - by, tool.position[0] - bx)
        radius, height = DRAWN_IN * self._reach, self.figures.heights.travel + LIFTED + extra
        at = (bx + radius * math.cos(direction), by + radius * math.sin(direction), height)
        return next(self._from_above(Pose.from_rpy(at, (0.0, 0.0, tool.yaw)), place, q), None)

    def _keeps_height(self, stops: Sequence[Sequence[float]]) -> bool:
        """Return whether the tool dips nowhere below the lower end of a way."""
        ends = (self.tool(stops[0]), self.tool(stops[-1]))
        lowest = min(end.position[2] for end in ends) - DIP
        places = places_along(stops, self.figures.steps)[1:-1]
        return all(self.tool(q).position[2] >= lowest for q in places.tolist())

    def _drop_places(self) -> Iterator[tuple[float, float, float]]:
        """Yield places around the arm, x, y [m], and the rail's place for each."""
        first, *_ = self.chain.joints
        rails = (self.on_rail(0.0), first.lower, first.upper) if self._rails else (0.0,)
        for share, rail in product(DROP_REACHES, rails):
            bx, by, _ = self._base(rail).position
            for step in range(DROP_DIRECTIONS):
                angle = 2 * math.pi * step / DROP_DIRECTIONS
                radius = share * self._reach
                yield bx + radius * math.cos(angle), by + radius * math.sin(angle), rail


def behind(chain: Chain) -> Chain:
    """Return a chain without its first joint, which is that of a rail."""
    links = {name: ChainLink(link.joints - 1, link.pose) for name, link in chain.links.items() if link.joints > 0}
    return Chain(chain.joints[1:], chain.base_T_tool, links)


def _steps(chain: Chain) -> Vector:
    """Return the motion of each joint that moves what is behind it by `STEP` at most."""
    points = [*(joint.point for joint in chain.joints), chain.base_T_tool.position]
    lengths = [math.dist(one, other) for one, other in pairwise(points)]
    return tuple(
        STEP if joint.is_prismatic else STEP / max(STEP, sum(lengths[number:]))
        for number, joint in enumerate(chain.joints)
    )
